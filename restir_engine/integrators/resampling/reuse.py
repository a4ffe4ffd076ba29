"""The stages of reuse between a technique's candidates and its shading, whatever the technique is."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...kernels.core.memory import address
from ...reuse_settings import ReuseSettings
from ..base import Stage, Tile
from .frame import Frame
from .history import History
from .options import PAIRS, reuse_records
from .spatial import spatial_tile
from .technique import SHIFTED
from .temporal import temporal_tile

if TYPE_CHECKING:
    from ...context import FrameContext


class Reuse:
    """Temporal and spatial reuse of the samples of a technique, a TECHNIQUE record (1,)."""

    def __init__(self, settings: ReuseSettings, technique: np.ndarray) -> None:
        self._technique = technique
        self.settings = settings
        self.records = reuse_records(settings, address(technique))

    def kernels(self) -> list:
        """Those that the settings need."""
        temporal = [temporal_tile] if self.settings.temporal else []
        return temporal + ([spatial_tile] if self.settings.rounds else [])

    def stages(
        self, context: FrameContext, integrator: np.ndarray, frame: Frame, history: History, seed: int
    ) -> list[Stage]:
        """The stages that take frame.reservoirs from candidates to what is shaded; seed: of this frame."""
        self.records["seed"] = seed
        found = []
        rounds = self.settings.rounds
        if history.before:
            args = (history, history.motion(context.scene).record, context, integrator, frame, rounds == 0)
            found.append(Stage(partial(self._temporal, *args), finish=frame.use_reservoirs))
        for turn in range(rounds):
            run = partial(self._spatial, context, integrator, frame, turn, turn == rounds - 1)
            found.append(Stage(run, finish=frame.use_reservoirs))
        return found

    def _spatial(self, context, integrator, frame, turn, last, tile: Tile, scratch: np.ndarray) -> None:
        for reuse in self.records:
            pairs = None
            if reuse["pattern"] == PAIRS:
                pairs = np.empty((tile[2] - tile[0]) * (tile[3] - tile[1]) * reuse["neighbours"], SHIFTED)
            work = address(pairs), address(scratch)
            spatial_tile(context.record, integrator[0], frame.record, reuse, *work, *tile, turn, int(last))

    def _temporal(self, history, motion, context, integrator, frame, last, tile: Tile, scratch) -> None:
        then = history.before
        for reuse in self.records:
            temporal_tile(
                context.record, context.camera_record, integrator[0], frame.record,
                then.context.record, then.context.camera_record, then.integrator[0], then.frame.record,
                motion, reuse, address(scratch), *tile, int(last),
            )  # fmt: skip
