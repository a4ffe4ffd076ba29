"""Light that crosses straight as RESTIR drives it: beside direct light, in companions of its frames."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ....kernels.core.memory import address
from ....kernels.core.records import SCENE_HAS_SUBSURFACE
from ....settings import RenderSettings
from ...base import Tile
from ...resampling.frame import Frame
from ...resampling.reuse import Reuse
from ..subsurface.sample import SUBSURFACE_RESERVOIR
from .candidates import refraction_candidates_tile
from .row import refraction_technique
from .sample import ENTRY
from .shade import add_crossing, hybrid_but_crossing

if TYPE_CHECKING:
    from ....context import FrameContext
    from ....scene.scene import Scene

BLOCK = 4.0  # the side of the blocks of pixels that share, see resampling.pairing


class RefractionLayer:
    """Candidates and reuse of light that crosses straight; `reuse` has the stages behind the candidates."""

    name = "refraction"

    def __init__(self, settings: RenderSettings) -> None:
        self.shading = add_crossing.address
        self.method = hybrid_but_crossing.address
        self._samples = settings.sss_refraction_samples
        options = replace(
            settings.reuse, rounds=1, temporal=settings.sss_refraction == "TEMPORAL", by_channel=False,
            pattern="PAIRS", radius=BLOCK, neighbours=settings.sss_neighbours, mis="DEFENSIVE", visibility="TARGET",
            history_target="BEFORE",
        )  # fmt: skip
        self.reuse = Reuse(
            options, refraction_technique(settings.sss_refraction), companion=self.name, mis_in_time="BALANCE"
        )

    def kernels(self) -> list:
        """What the stages run."""
        return [refraction_candidates_tile, *self.reuse.kernels()]

    def accompany(self, frame: Frame) -> None:
        """Give a frame its companion."""
        frame.accompany(self.name, SUBSURFACE_RESERVOIR, ENTRY)

    def candidates(
        self, last: int, context: FrameContext, integrator: np.ndarray, film: np.void, frame: Frame, tile: Tile,
        scratch: np.ndarray,
    ) -> None:  # fmt: skip
        """Fill the companion of a frame in a tile; last: whether no reuse follows."""
        refraction_candidates_tile(
            context.record, integrator[0], self.reuse.records[0], frame.companions[self.name].record, address(scratch),
            self._samples, *tile, last,
        )  # fmt: skip


def resamples_refraction(scene: Scene, settings: RenderSettings) -> bool:
    """Whether the settings ask for the layer, and the scene has what it serves.

    HYBRID alone has light that crosses by itself; where there is an irradiance cache, that knows what it finds.
    """
    wanted = settings.sss_refraction != "NONE" and settings.sss_method == "HYBRID"
    return bool(wanted and not settings.sss_irradiance_cache and scene.record["flags"] & SCENE_HAS_SUBSURFACE)
