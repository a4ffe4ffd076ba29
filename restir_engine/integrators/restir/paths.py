"""The steps of a frame that whole paths have of their own, in place of those of direct light."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kernels.core.direct import Direct
from ...kernels.core.memory import address
from ...kernels.core.records import SCENE_HAS_MEDIA
from ...reuse_settings import ReuseSettings
from ...scene.scene import Scene
from ..resampling.frame import Frame
from ..techniques.path.light import light_tile
from ..techniques.path.row import path_technique
from ..techniques.path.sample import PATH_RESERVOIR
from ..techniques.path.trace import paths_tile

if TYPE_CHECKING:
    from .integrator import RestirIntegrator

PATHS, LIGHT = Direct(paths_tile), Direct(light_tile)


def resamples_paths(options: ReuseSettings, scene: Scene) -> bool:
    """Whether indirect light is reused.

    Where anything is, p̂ has V in it and is one, no path crosses a medium, and all paths see the same moment: what a
    sample has kept behind the vertex of reconnection is of its own.
    """
    reused = options.temporal or options.rounds > 0
    served = options.visibility == "TARGET" and not options.by_channel and not scene.record["flags"] & SCENE_HAS_MEDIA
    wanted = options.paths != "DIRECT" and reused and served
    if wanted and scene.record["shutter"]:
        scene.warnings.add("Render", "Reuse", "with motion blur direct light alone is reused, and no whole paths")
        return False
    return wanted


class PathSteps:
    """Candidates and lighting of whole paths, for an integrator."""

    kernels = paths_tile, light_tile
    reservoir = PATH_RESERVOIR

    def __init__(self, record: np.ndarray, light_groups: int) -> None:
        """record: the integrator's, INTEGRATOR (1,); light_groups: its FILM.light_groups."""
        self.technique, self._film = path_technique(light_groups)
        self._unclamped = record.copy()
        self._unclamped["clamp_direct"] = self._unclamped["clamp_indirect"] = np.inf

    def candidates(self, last: int, own: RestirIntegrator, frame: Frame, tile, scratch: np.ndarray) -> None:
        """Follow the paths of a tile for an integrator; last: not 0 where no reuse follows."""
        context = own.context
        args = (context.address, int(context.record["camera"]), address(own.record), own.film.address, frame.address)
        PATHS(*args, address(own.reuse.records), int(self.technique[0]["taker"]), address(scratch), *tile, last)

    def light(self, own: RestirIntegrator, frame: Frame, tile, scratch: np.ndarray) -> None:
        """Light the pixels of a tile by what is left of them."""
        LIGHT(address(self._unclamped), own.film.address, frame.address, address(scratch), *tile)
