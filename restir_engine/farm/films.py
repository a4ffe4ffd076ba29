"""Films from the passes of a file, and passes of a film to a file."""

from __future__ import annotations

import numpy as np

from ..film import Film
from ..settings import PASSES, SAMPLE_COUNT, SHADOW_CATCHER, Pass, aov_passes, light_group_passes
from .exr import Key, MultilayerFile
from .record import Record, aovs_of


def passes_in(file: MultilayerFile, layer: str, view: str) -> dict[Pass, Key]:
    """The passes of a view of a layer that we know, in the order that a film wants them in."""
    record = file.records[layer]
    by_name = {key.name: key for key in file.keys if (key.layer, key.view) == (layer, view)}
    known = [item for item in PASSES if not item.slots]
    known += [*aov_passes(aovs_of(record)), *light_group_passes(record.light_groups)]
    known += [item for item in PASSES if item.slots]
    found = {item: by_name.get(item.name) or by_name.get(item.name_4) for item in known}
    return {item: key for item, key in found.items() if key}


def views_of(file: MultilayerFile) -> list[tuple[str, str]]:
    """(view layer, view) of all pictures in a file."""
    return list(dict.fromkeys((key.layer, key.view) for key in file.keys))


def arrays_of(file: MultilayerFile, layer: str, view: str, rows: slice = slice(None)) -> dict[str, np.ndarray]:
    """Rows of the passes of a view of a layer by our names, as `Film.pass_array` gives them."""
    return {item.name: file.pixels(key, item.channels, rows) for item, key in passes_in(file, layer, view).items()}


def empty_film(file: MultilayerFile, layer: str, view: str, height: int | None = None) -> Film:
    """A film without samples for a view of a layer, or for so many rows of it; it shows no catchers."""
    record, (width, all_rows) = file.records[layer], file.size
    film = Film(width, height or all_rows, list(passes_in(file, layer, view)), record.exposure, record.transparent)
    film.shows_catchers = False
    film.count_pixels()
    return film


def film_of(file: MultilayerFile, layer: str, view: str, rows: slice = slice(None)) -> Film:
    """The film that a view of a layer was made of, or rows of it."""
    arrays = arrays_of(file, layer, view, rows)
    film = empty_film(file, layer, view, len(arrays["Combined"]))
    film.load(arrays, counts_of(arrays, file.records[layer], film))
    return film


def counts_of(arrays: dict[str, np.ndarray], record: Record, film: Film) -> np.ndarray:
    """Samples of each pixel (height, width): by their pass, else all that the record tells of."""
    if SAMPLE_COUNT in arrays:
        return np.rint(arrays[SAMPLE_COUNT][..., 0]).astype(np.int32)
    return np.full((film.height, film.width), record.samples, np.int32)


def put_film(film: Film, file: MultilayerFile, layer: str, view: str, combined: np.ndarray | None = None) -> None:
    """Set the passes of a view of a layer to those of a film; combined: in place of its own, if it was denoised.

    A pass stays as it is where it is divided by nothing: Blender has values of its own for what an engine leaves out.
    """
    for item, key in passes_in(file, layer, view).items():
        own = combined is not None and item.name == "Combined"
        values = combined if own else film.pass_array(item.name)
        if item.divide and item.name != SHADOW_CATCHER:
            values = np.where(
                film.sums(item.divide)[..., : values.shape[2]] == 0.0, file.pixels(key, item.channels), values
            )
        file.put(key, item.channels, values)
