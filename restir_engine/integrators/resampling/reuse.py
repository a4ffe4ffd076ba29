"""The stages of reuse between a technique's candidates and its shading, whatever the technique is."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...kernels.core.direct import Direct
from ...kernels.core.memory import address
from ...reuse_settings import ReuseSettings
from ..base import Stage, Tile
from .frame import Frame
from .history import History
from .options import reuse_records
from .pairing import block_of
from .spatial import spatial_tile
from .technique import SHIFTED
from .temporal import temporal_tile

if TYPE_CHECKING:
    from ...context import FrameContext

SPATIAL = Direct(spatial_tile)


class Reuse:
    """Temporal and spatial reuse of the samples of a technique, a TECHNIQUE record (1,).

    later: the records of spatial rounds behind the first, where these shift otherwise. companion: the name of the
    frames' companions that have the samples; None: the frames themselves. mis_in_time: MIS weights of temporal reuse,
    where they are not the settings'.
    """

    def __init__(
        self,
        settings: ReuseSettings,
        technique: np.ndarray,
        later: Sequence[np.ndarray] = (),
        companion: str | None = None,
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
        self._idle: deque[np.ndarray] = deque()  # working memory of PAIRS

    def kernels(self) -> list:
        """Those that the settings need."""
        temporal = [temporal_tile] if self.settings.temporal else []
        return temporal + ([spatial_tile] if self.settings.rounds else [])

    def stages(
        self, context: FrameContext, integrator: np.ndarray, frame: Frame, history: History, seed: int
    ) -> list[Stage]:
        """The stages that take frame.reservoirs from candidates to what is shaded; seed: of this frame."""
        for records in (self._in_time, *self.by_round):
            self._begin(records, seed)
        found = []
        rounds = self.settings.rounds
        if history.before and self.settings.temporal and self._own(history.before.frame):
            args = (history, history.motion(context.scene).record, context, integrator, frame, rounds == 0)
            found.append(Stage(partial(self._temporal, *args), finish=frame.use_reservoirs))
        for turn in range(rounds):
            run = partial(self._spatial, context, integrator, frame, self._of_round(turn), turn)
            found.append(Stage(run, finish=frame.use_reservoirs))
        return found

    def _own(self, frame: Frame) -> Frame | None:
        """The frame, or its companion, that has the samples; None: the scene had nothing to sample then."""
        return frame.companions.get(self._companion) if self._companion else frame

    def corner(self, seed: int) -> tuple[int, int]:
        """By how many pixels the blocks of a frame begin before multiples of their side, along x and y."""
        options = self.settings
        if not options.rounds or options.pattern != "PAIRS" or not options.moving_blocks:
            return 0, 0
        side = block_of.py_func(options.radius)
        return seed % side, seed // side % side

    def _begin(self, records: np.ndarray, seed: int) -> None:
        """Let records be those of a frame."""
        records["seed"] = seed
        records["left"], records["below"] = self.corner(seed)

    @property
    def block(self) -> int:
        """The side of the blocks (see `corner`) that no sample leaves; 0: they may come from anywhere."""
        options = self.settings
        anywhere = options.temporal or (options.rounds and options.pattern == "DISK")
        return 0 if anywhere else block_of.py_func(options.radius)

    def within_tile(self, context: FrameContext, integrator: np.ndarray, seed: int) -> Callable:
        """All rounds as a function of a frame that holds a tile of whole blocks, the tile and working memory."""
        rounds = [self._of_round(turn).copy() for turn in range(self.settings.rounds)]
        for records in rounds:
            self._begin(records, seed)

        def reuse(frame: Frame, tile: Tile, scratch: np.ndarray) -> None:
            for turn, records in enumerate(rounds):
                self._spatial(context, integrator, frame, records, turn, tile, scratch)
                frame.use_reservoirs()

        return reuse

    def _of_round(self, turn: int) -> np.ndarray:
        return self.by_round[min(turn, len(self.by_round) - 1)]

    def _spatial(self, context, integrator, frame, records, turn, tile: Tile, scratch: np.ndarray) -> None:
        last = turn == self.settings.rounds - 1
        pairs = self._pairs()
        args = context.address, address(integrator), frame.address
        for k in range(len(records)):
            reuse = address(records) + k * records.itemsize
            SPATIAL(*args, reuse, address(pairs), address(scratch), *tile, turn, int(last))
        if pairs is not None:
            self._idle.append(pairs)

    def _pairs(self) -> np.ndarray | None:
        """Room for SHIFTED of all pairs of a block."""
        if self.settings.pattern != "PAIRS":
            return None
        try:
            return self._idle.pop()
        except IndexError:
            return np.empty(block_of.py_func(self.settings.radius) ** 2 * self.settings.neighbours, SHIFTED)

    def _temporal(self, history, motion, context, integrator, frame, last, tile: Tile, scratch) -> None:
        then = history.before
        before = self._own(then.frame)
        for reuse in self._in_time:
            temporal_tile(
                context.record, context.camera_record, integrator[0], frame.record,
                then.context.record, then.context.camera_record, then.integrator[0], before.record,
                motion, reuse, address(scratch), *tile, int(last),
            )  # fmt: skip
