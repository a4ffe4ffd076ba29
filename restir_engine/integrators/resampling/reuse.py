"""The stages of reuse between a technique's candidates and its shading, whatever the technique is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
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
    """Temporal and spatial reuse of the samples of a technique, a TECHNIQUE record (1,).

    later: the records of spatial rounds behind the first, where these shift otherwise. companion: whether the samples
    are those of the frames' companions. mis_in_time: MIS weights of temporal reuse, where they are not the settings'.
    """

    def __init__(
        self,
        settings: ReuseSettings,
        technique: np.ndarray,
        later: Sequence[np.ndarray] = (),
        companion: bool = False,
        mis_in_time: str | None = None,
    ) -> None:
        self._techniques = (technique, *later)
        self._companion = companion
        self.settings = settings
        self.records = reuse_records(settings, address(technique))
        self._in_time = self.records
        if mis_in_time:
            self._in_time = reuse_records(replace(settings, mis=mis_in_time), address(technique))
        later = [reuse_records(settings, address(one)) for one in later]
        self.by_round = [self.records, *later]  # the last one goes on for all rounds behind it

    def kernels(self) -> list:
        """Those that the settings need."""
        temporal = [temporal_tile] if self.settings.temporal else []
        return temporal + ([spatial_tile] if self.settings.rounds else [])

    def stages(
        self, context: FrameContext, integrator: np.ndarray, frame: Frame, history: History, seed: int
    ) -> list[Stage]:
        """The stages that take frame.reservoirs from candidates to what is shaded; seed: of this frame."""
        for records in (self._in_time, *self.by_round):
            records["seed"] = seed
        found = []
        rounds = self.settings.rounds
        if history.before and self.settings.temporal:
            args = (history, history.motion(context.scene).record, context, integrator, frame, rounds == 0)
            found.append(Stage(partial(self._temporal, *args), finish=frame.use_reservoirs))
        for turn in range(rounds):
            run = partial(self._spatial, context, integrator, frame, turn, turn == rounds - 1)
            found.append(Stage(run, finish=frame.use_reservoirs))
        return found

    def _spatial(self, context, integrator, frame, turn, last, tile: Tile, scratch: np.ndarray) -> None:
        for reuse in self.by_round[min(turn, len(self.by_round) - 1)]:
            pairs = None
            if reuse["pattern"] == PAIRS:
                pairs = np.empty((tile[2] - tile[0]) * (tile[3] - tile[1]) * reuse["neighbours"], SHIFTED)
            work = address(pairs), address(scratch)
            spatial_tile(context.record, integrator[0], frame.record, reuse, *work, *tile, turn, int(last))

    def _temporal(self, history, motion, context, integrator, frame, last, tile: Tile, scratch) -> None:
        then = history.before
        before = then.frame.companion if self._companion else then.frame
        for reuse in self._in_time:
            temporal_tile(
                context.record, context.camera_record, integrator[0], frame.record,
                then.context.record, then.context.camera_record, then.integrator[0], before.record,
                motion, reuse, address(scratch), *tile, int(last),
            )  # fmt: skip
