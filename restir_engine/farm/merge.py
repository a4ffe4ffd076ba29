"""Merge renders of ranges of the samples of one picture, multilayer OpenEXR files, to one of all of them.

    python -m restir_engine.farm.merge -o merged.exr part_1.exr part_2.exr …
    python -m restir_engine.farm.merge -o finished.exr --finish part_*.exr
    blender --command restir_merge -o merged.exr part_*.exr

What is merged are the sums that the passes were made of: each is divided by what all files add up to, as in one render.
Where pixels have unlike numbers of samples, the pass Debug Sample Count has them. The merged file can be merged with
further ones. --finish leaves it as one render of all samples does: denoised where that was asked for (--denoise: in any
case), shadow catchers in Combined, without what is only there for merging.
"""

from __future__ import annotations

import argparse
import importlib.util
import logging
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from .. import denoise
from ..film import Film
from ..scene.cryptomatte import KINDS, united
from ..scene.warnings import Warnings
from ..session import format_time
from ..settings import CATCHER_BACKDROP, DENOISING_PASSES, PASS_BY_NAME
from .exr import FileError, Key, MultilayerFile
from .films import empty_film, film_of, passes_in, put_film, views_of
from .manifests import united_manifests
from .record import IN_COMMON, Record, alike, merged

BAND = 1 << 21  # numbers of a film that are added at a time, so that they stay in the processor's cache


class Sum:
    """What the files merged so far add up to in a view of a layer; `header` is one of them."""

    def __init__(self, header: MultilayerFile, layer: str, view: str) -> None:
        self._place = layer, view
        self._film, self._begins = empty_film(header, layer, view), math.inf
        height, step = self._film.height, max(1, BAND // self._film.pixels[0].size)
        self._bands = [slice(row, min(row + step, height)) for row in range(0, height, step)]
        self._slots = {kind: [self._film.slots(kind)[rows] for rows in self._bands] for kind in KINDS}

    def add(self, file: MultilayerFile) -> None:
        """Add another file."""
        ranges = file.records[self._place[0]].ranges
        begins = ranges[0][0] if ranges else math.inf
        for number, rows in enumerate(self._bands):
            film = film_of(file, *self._place, rows)
            for kind, bands in self._slots.items():
                if bands[number].size:  # all ids: which cover most shows at the end
                    bands[number] = united(bands[number], film.slots(kind))
            self._film.add(film, rows.start, before=begins < self._begins)
        self._begins = min(begins, self._begins)

    def film(self) -> Film:
        """The film of all samples; where a pixel has more ids than slots, those that cover least are left out."""
        for kind, bands in self._slots.items():
            for rows, slots in zip(self._bands, bands, strict=True):
                kept = self._film.slots(kind)[rows]
                count = min(slots.shape[2], kept.shape[2])
                kept[:, :, :count], kept[:, :, count:] = slots[:, :, :count], 0.0
        return self._film


def merge(
    paths: Sequence[str | Path],
    out: str | Path,
    finish: bool = False,
    quality: str = "",
    progress: Callable[[float], None] = lambda share: None,
) -> list[str]:
    """Merge files into `out` and return what is to be warned of.

    quality: that of a denoiser which `finish` uses in any case; "": by the render settings. progress: gets 0 to 1.
    Raises FileError, with nothing written, where files are not of one picture.
    """
    headers = [MultilayerFile(path, header_only=True) for path in paths]
    warnings = check(headers)
    steps = len(headers) + 1
    sums = {place: Sum(headers[0], *place) for place in views_of(headers[0])}
    first = headers[0]
    for number, header in enumerate(reversed(headers)):
        del first  # before the next is read: they are large
        first = MultilayerFile(header.path)  # and the last to be read: it takes what is written
        for total in sums.values():
            total.add(first)
        progress((number + 1) / steps)
    records = {layer: merged([header.records[layer] for header in headers]) for layer in first.records}
    fields, dropped = united_manifests([header.fields for header in headers]), set()
    for (layer, view), total in sums.items():
        film, record, combined = total.film(), records[layer], None
        if finish:
            combined, told = finished(film, quality or record.denoising)
            dropped |= carried_along(first, layer, view, record)
            records[layer] = replace(record, finished=True, warnings=tuple(dict.fromkeys((*record.warnings, *told))))
            warnings += [f"{kind} “{name}”: {text}" for kind, name, text in told]
        put_film(film, first, layer, view, combined)
    for layer, record in records.items():
        fields |= record.fields(layer)
    if "RenderTime" in first.fields:  # Blender's own
        fields["RenderTime"] = format_time(sum(record.render_time for record in records.values()))
    first.write(out, fields, without=dropped)
    progress(1.0)
    return warnings


def finished(film: Film, quality: str) -> tuple[np.ndarray, Warnings]:
    """Combined as a render of all samples leaves it, and warnings; quality: of the denoiser, "": it stays as it is."""
    warnings = Warnings()
    names = {item.name for item in film.passes}
    film.shows_catchers = CATCHER_BACKDROP in names
    combined = None
    if quality and not names >= DENOISING_PASSES:
        text = "the ranges have no Denoising Data: render them with Denoise on, or with that pass"
        warnings.add("Render", "Denoise", text)
    elif quality:
        combined = denoise.denoise(film, quality, warnings)
    return film.pass_array("Combined") if combined is None else combined, warnings


def carried_along(file: MultilayerFile, layer: str, view: str, record: Record) -> set[Key]:
    """The passes that nobody asked for."""
    places = passes_in(file, layer, view)
    return {key for item, key in places.items() if item.name in PASS_BY_NAME and item.name not in record.passes}


def check(files: list[MultilayerFile]) -> list[str]:
    """Raise FileError where files are not parts of one picture; returns what they leave out."""
    first = files[0]
    for file in files:
        if not file.records:
            raise FileError(
                f"“{file.path}” does not tell of its samples: only multilayer OpenEXR files that this engine has "
                "rendered can be merged."
            )
    for file in files[1:]:
        _check_pair(first, file)
    for layer in first.records:
        _check_ranges(layer, files)
    others = dict.fromkeys(name.rpartition(".")[0] or name for file in files for name in file.others)
    warnings = [f"left out, since it is no pass of a view layer: {name}" for name in others]
    for layer in first.records:
        record = merged([file.records[layer] for file in files])
        for start, end in record.missing:
            names = ", ".join(f"“{file.path.name}”" for file in files)
            warnings.append(f"Samples {start} to {end} of {record.of} (view layer “{layer}”) are in none of {names}")
    return warnings


def _check_pair(one: MultilayerFile, other: MultilayerFile) -> None:
    def differ(what: str) -> FileError:
        return FileError(f"“{one.path}” and “{other.path}” are not of one picture: they have different {what}.")

    if one.size != other.size:
        raise differ(f"sizes ({' and '.join('{} × {}'.format(*file.size) for file in (one, other))})")
    if one.records.keys() != other.records.keys():
        raise differ("view layers")
    for layer, record in one.records.items():
        for name, words in IN_COMMON.items():
            values = getattr(record, name), getattr(other.records[layer], name)
            if not alike(*values):
                told = f" ({values[0]} and {values[1]})" if isinstance(values[0], str | int) else ""
                raise differ(f"{words}{told if name != 'settings' else ''}")
    for file, of in ((one, other), (other, one)):
        lost = [key for key in file.keys if key not in of.keys]
        if lost:
            raise differ(f"passes ({', '.join('.'.join(filter(None, key)) for key in lost)})")


def _check_ranges(layer: str, files: list[MultilayerFile]) -> None:
    taken: list[tuple[int, int, MultilayerFile]] = []
    for file in files:
        for first, last in file.records[layer].ranges:
            for start, end, other in taken:
                low, high = max(first, start), min(last, end)
                if low < high:
                    raise FileError(
                        f"“{other.path}” and “{file.path}” both have samples {low} to {high} of view layer “{layer}”."
                    )
            taken.append((first, last, file))


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse a command line and merge; returns 0, or 1 where nothing was written."""
    parser = argparse.ArgumentParser(
        "restir_merge", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="+", type=Path, metavar="PART.exr", help="renders of ranges of the samples")
    parser.add_argument("-o", "--out", required=True, type=Path, metavar="OUT.exr", help="the file to be written")
    parser.add_argument("--finish", action="store_true", help="leave it as one render of all samples does")
    parser.add_argument("--denoise", action="store_true", help="finish it, and denoise it in any case")
    options = parser.parse_args(arguments)
    logging.getLogger(Warnings.__module__).setLevel(logging.ERROR)  # they are printed below
    _find_denoiser()
    if options.denoise and denoise.find_library() is None:
        parser.error("there is no Open Image Denoise here: use `blender --command restir_merge`, or install bpy")
    try:
        warnings = merge(options.parts, options.out, options.finish or options.denoise, "HIGH" * options.denoise)
    except FileError as error:
        print(f"Error: {error}", file=sys.stderr)
        return 1
    for line in warnings:
        print(f"Warning: {line}", file=sys.stderr)
    print(f"Saved: {options.out}")
    return 0


def _find_denoiser() -> None:
    """Outside of Blender its denoiser is that of the package bpy, if there is one."""
    found = importlib.util.find_spec("bpy") if denoise.find_library() is None else None
    if found and found.origin:
        denoise.configure([Path(found.origin).parent / "lib"])


if __name__ == "__main__":
    sys.exit(main())
