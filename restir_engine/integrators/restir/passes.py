"""The passes of reuse between candidates and shading, and the history that a frame leaves to the next."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...kernels.core.memory import address
from ..base import Stage, Tile
from ..resampling.frame import Frame
from ..resampling.motion import Motion
from ..resampling.options import reuse_record
from ..resampling.spatial import spatial_tile
from ..resampling.temporal import temporal_tile

if TYPE_CHECKING:
    from ...context import FrameContext
    from ...scene.scene import Scene
    from ...settings import RenderSettings
    from ..base import Integrator

NO_TILE = (0, 0, 0, 0)
CHANNELS = (0, 1, 2)
# Fields of REUSE that are settings, there with `restir_` in front.
_OPTIONS = (
    "light_samples",
    "mis",
    "confidence_cap",
    "neighbours",
    "radius",
    "visibility",
    "discard",
    "near",
    "history_target",
)


@dataclass(frozen=True)
class ReusePlan:
    """Which reuse there is: temporal or not, rounds of spatial reuse, one reservoir a channel or one for all.

    `options` are the fields of REUSE by name, see `options.reuse_record`.
    """

    temporal: bool = False
    rounds: int = 0
    by_channel: bool = False
    options: dict = field(default_factory=dict)


def plan_of(settings: RenderSettings) -> ReusePlan:
    """The reuse that the settings ask for."""
    return ReusePlan(
        settings.restir_temporal,
        settings.restir_rounds,
        settings.restir_by_channel,
        {name: getattr(settings, f"restir_{name}") for name in _OPTIONS},
    )


class Before(NamedTuple):
    """The frame before, and all that p̂ was evaluated with there."""

    context: FrameContext
    integrator: np.ndarray  # INTEGRATOR (1,)
    tables: tuple[np.ndarray, ...]  # what the INTEGRATOR points to
    frame: Frame


class Passes:
    """Temporal and spatial reuse of one scene's frames; kept from frame to frame, it holds the frame before.

    The frame before is that of the sample before; where a scene has taken another's place, it is that scene's last.
    """

    def __init__(self, plan: ReusePlan) -> None:
        self.plan = plan
        channels = CHANNELS if plan.by_channel else (-1,)
        self.reuse = np.concatenate([reuse_record(channel=channel, **plan.options) for channel in channels])
        self._mean_visibilities: np.ndarray | None = None
        self._before: Before | None = None
        self._motion: tuple[Scene, Scene, Motion] | None = None

    def mean_visibilities_of(self, width: int, height: int) -> np.ndarray:
        """What lights.mean_visibility keeps of each pixel, float32 (height, width, 4); begun anew for another size."""
        if self._mean_visibilities is None or self._mean_visibilities.shape[:2] != (height, width):
            self._mean_visibilities = np.zeros((height, width, 4), np.float32)
        return self._mean_visibilities

    def use_seed(self, seed: int) -> None:
        """Let this frame draw from its own random numbers."""
        self.reuse["seed"] = seed

    def remember(self, integrator: Integrator, frame: Frame) -> Frame | None:
        """Make a finished frame the one before; the frame that was it, whose arrays may be used again."""
        old = self._before.frame if self._before else None
        self._before = _before(integrator, frame)
        return old

    def stages(self, context: FrameContext, integrator: np.ndarray, frame: Frame) -> list[Stage]:
        """The stages that take frame.reservoirs from candidates to what is shaded."""
        found = []
        run = partial(self._each, context, integrator, frame)
        if self.plan.temporal and self._before:
            self._follow(context.scene, self._before.context.scene)
            found.append(Stage(partial(run, self._temporal), finish=frame.use_reservoirs))
        for turn in range(self.plan.rounds):
            last = turn == self.plan.rounds - 1
            found.append(Stage(partial(run, partial(self._spatial, turn, last)), finish=frame.use_reservoirs))
        return found

    def load(self, integrator: Integrator, frame: Frame, scratch: np.ndarray) -> None:
        """Compile the kernels that the plan needs, or load them from the cache."""
        kept = self._before
        self._before = self._before or _before(integrator, frame)
        for stage in self.stages(integrator.context, integrator.record, frame):
            stage.run(NO_TILE, scratch)
        self._before = kept

    def _each(self, context, integrator, frame, step, tile: Tile, scratch: np.ndarray) -> None:
        for reuse in self.reuse:
            step(context.record, context.camera_record, integrator[0], frame, reuse, address(scratch), tile)

    def _spatial(self, turn, last, scene, camera, integrator, frame, reuse, scratch, tile) -> None:
        spatial_tile(scene, camera, integrator, frame.record, reuse, scratch, *tile, turn, int(last))

    def _temporal(self, scene, camera, integrator, frame, reuse, scratch, tile) -> None:
        then = self._before
        last = int(self.plan.rounds == 0)
        temporal_tile(
            scene, camera, integrator, frame.record,
            then.context.record, then.context.camera_record, then.integrator[0], then.frame.record,
            self._motion[2].record, reuse, scratch, *tile, last,
        )  # fmt: skip

    def _follow(self, now: Scene, before: Scene) -> None:
        """See to it that the motion between these two is known."""
        if self._motion is None or self._motion[0] is not now or self._motion[1] is not before:
            self._motion = (now, before, Motion(now, before))


def _before(integrator: Integrator, frame: Frame) -> Before:
    record = integrator.record.copy()
    return Before(integrator.context, record, integrator.tables, frame)
