"""A merged file in place of a render: what `scene.restir.film_from` names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..scene.errors import SceneError
from ..scene.warnings import Warnings
from ..settings import RenderSettings, shown_passes
from ..sync.camera import border, frame_size
from .exr import FileError, MultilayerFile
from .films import arrays_of, film_of, views_of
from .manifests import cryptomatte_fields
from .merge import finished


class Delivered:
    """What the engine hands over of a `Session` that is done: the passes of a view, and the settings that name them."""

    is_valid = True

    def __init__(self, arrays: dict[str, np.ndarray], settings: RenderSettings) -> None:
        self._arrays, self.film, self.settings = arrays, self, settings
        self.height, self.width = arrays["Combined"].shape[:2]

    def pass_array(self, name: str) -> np.ndarray:
        """A pass: float32 (height, width, channels), rows bottom to top."""
        return self._arrays[name]

    def combined(self) -> np.ndarray:
        """The Combined pass."""
        return self._arrays["Combined"]


class LayerFromFile:
    """A view layer of a file, finished by the settings of a render: denoised once, shadow catchers in Combined.

    scene: Blender's, by which the file must have the size of the picture or of its render region.
    `fields` is what is to be told with the picture, `warnings` (of the render, and of `deliveries`) what of it.
    Raises SceneError where the file does not serve.
    """

    def __init__(self, path: str, layer: str, settings: RenderSettings, scene) -> None:
        render = scene.render
        try:
            self._file = MultilayerFile(path)
        except FileError as error:
            raise SceneError(str(error)) from error
        if layer not in self._file.records:
            raise SceneError(f"“{path}” has no samples of the view layer “{layer}”: render it again with that.")
        self._layer, self._settings = layer, settings
        self._require_size(render)
        views = [view for of, view in views_of(self._file) if of == layer]
        missing = {view.name for view in render.views if view.use} - set(views) if render.use_multiview else ()
        if missing:
            raise SceneError(f"“{path}” has no view “{min(missing)}”: save all views of its ranges in one file.")
        self._views = views
        self._record = self._file.records[layer]
        self.warnings = Warnings()
        self._warn(self._record.warnings)
        if self._record.frame != scene.frame_current:
            self.warnings.add("File", self._file.path.name, f"it is of frame {self._record.frame}")
        for first, last in self._record.missing:
            self.warnings.add(
                "File", self._file.path.name, f"samples {first} to {last} of {self._record.of} are missing"
            )
        record = replace(self._record, finished=True)
        self.fields = cryptomatte_fields(self._file.fields) | record.fields(layer)

    def deliveries(self) -> Iterator[tuple[str, Delivered]]:
        """The name of each view, "" where there is only one, and what is to be handed over."""
        for view in self._views:
            arrays = self._finished(view)
            wanted = self._settings
            lost = [item.name for item in shown_passes(wanted.passes, wanted.aovs, wanted.light_groups)
                    if item.name not in arrays]  # fmt: skip
            if lost:
                self._warn([("View Layer", self._layer, f"passes that the file does not have: {', '.join(lost)}")])
            there = replace(
                wanted,
                passes=wanted.passes - set(lost),
                aovs=tuple(aov for aov in wanted.aovs if aov.name in arrays),
                light_groups=tuple(name for name in wanted.light_groups if f"Combined_{name}" in arrays),
            )
            yield view, Delivered(arrays, there)

    def _finished(self, view: str) -> dict[str, np.ndarray]:
        if self._record.finished:
            return arrays_of(self._file, self._layer, view)
        film = film_of(self._file, self._layer, view)
        combined, told = finished(film, self._settings.denoising_quality if self._settings.use_denoising else "")
        self._warn(told)
        return {item.name: film.pass_array(item.name) for item in film.passes} | {"Combined": combined}

    def _warn(self, entries) -> None:
        for entry in entries:
            self.warnings.add(*entry)

    def _require_size(self, render) -> None:
        frame = frame_size(render)
        region = border(render, *frame)
        wanted = region[2:] if region else frame
        if self._file.size != wanted:
            sizes = " × ".join(map(str, self._file.size)), " × ".join(map(str, wanted))
            raise SceneError(f"“{self._file.path}” has {sizes[0]} pixels, the picture {sizes[1]}.")
