"""Subsurface light as RESTIR drives it: beside direct light, at the same points, in companions of its frames."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ....kernels.core.memory import address
from ....kernels.subsurface.methods import exits_entries, exits_flag
from ....settings import RenderSettings, resampled_shift
from ...base import Tile
from ...resampling.frame import Frame
from ...resampling.reuse import Reuse
from .candidates import subsurface_candidates_tile
from .row import subsurface_techniques
from .sample import POINT, SUBSURFACE_RESERVOIR
from .shade import add_light, go_on
from .watch import watches

if TYPE_CHECKING:
    from ....context import FrameContext
    from ....scene.scene import Scene


class SubsurfaceLayer:
    """Candidates and reuse of subsurface light; `reuse` has the stages behind the candidates."""

    name = "subsurface"

    def __init__(self, settings: RenderSettings, refraction: bool) -> None:
        """refraction: whether light that crosses straight is resampled by itself."""
        self._refraction = int(refraction)
        self._codes = exits_entries(settings.sss_method)
        self.shading = add_light.address
        self.go_on = go_on.address
        first, *later = subsurface_techniques(resampled_shift(settings), watches(settings.passes))
        options = replace(
            settings.reuse, rounds=1 + len(later), temporal=settings.sss_temporal, by_channel=False, pattern="DISK",
            neighbours=settings.sss_neighbours, mis="DEFENSIVE", visibility="TARGET", history_target="BEFORE",
        )  # fmt: skip
        self.reuse = Reuse(options, first, later, companion=self.name, mis_in_time="BALANCE")

    def kernels(self) -> list:
        """What the stages run."""
        return [subsurface_candidates_tile, *self.reuse.kernels()]

    def accompany(self, frame: Frame) -> None:
        """Give a frame its companion."""
        frame.accompany(self.name, SUBSURFACE_RESERVOIR, POINT, radii=True)

    def candidates(
        self, last: int, context: FrameContext, integrator: np.ndarray, film: np.void, frame: Frame, tile: Tile,
        scratch: np.ndarray,
    ) -> None:  # fmt: skip
        """Fill the companion of a frame in a tile; last: whether no reuse follows."""
        subsurface_candidates_tile(
            context.record, integrator[0], film, self.reuse.records[0], frame.companions[self.name].record,
            address(scratch), *self._codes, self._refraction, *tile, last,
        )  # fmt: skip


def resamples_subsurface(scene: Scene, settings: RenderSettings) -> bool:
    """Whether the settings ask for the layer, and the scene has what it serves."""
    return resampled_shift(settings) != "NONE" and bool(scene.have_flag(exits_flag(settings.sss_method)).any())
