"""What a sequence of frames leaves to its next one. The session owns it and hands it from integrator to integrator."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .frame import Frame
from .motion import Motion

if TYPE_CHECKING:
    from ...context import FrameContext
    from ...scene.scene import Scene
    from ..base import Integrator


class Before(NamedTuple):
    """The frame before, and all that p̂ was evaluated with there."""

    context: FrameContext
    integrator: np.ndarray  # INTEGRATOR (1,)
    tables: tuple[np.ndarray, ...]  # what the INTEGRATOR points to
    frame: Frame


class History:
    """The frame before of frames with the same settings of reuse, and what their pixels know of visibility.

    The frame before is that of the sample before; where a scene has taken another's place, it is that scene's last.
    `before` is None where there is no such frame yet, or where nothing is reused in time.
    """

    def __init__(self, settings: tuple) -> None:
        self.settings = settings
        self.before: Before | None = None
        self._mean_visibilities: np.ndarray | None = None
        self._motion: tuple[Scene, Scene, Motion] | None = None

    def serves(self, settings: tuple) -> bool:
        """Whether frames with these settings may go on with it: reservoirs mean the same to them."""
        return self.settings == settings

    def mean_visibilities(self, width: int, height: int) -> np.ndarray:
        """What lights.mean_visibility keeps of each pixel, float32 (height, width, 4); begun anew for another size."""
        if self._mean_visibilities is None or self._mean_visibilities.shape[:2] != (height, width):
            self._mean_visibilities = np.zeros((height, width, 4), np.float32)
        return self._mean_visibilities

    def motion(self, now: Scene) -> Motion:
        """The motion between the scene of the frame before and the one now."""
        before = self.before.context.scene
        if self._motion is None or self._motion[0] is not now or self._motion[1] is not before:
            self._motion = (now, before, Motion(now, before))
        return self._motion[2]

    def remember(self, integrator: Integrator, frame: Frame) -> Frame | None:
        """Make a finished frame the one before; returns the one that was if its arrays fit for the next."""
        old = self.before.frame if self.before else None
        if old and (old.pixels.shape != frame.pixels.shape or old.companions.keys() != frame.companions.keys()):
            old = None
        self.before = Before(integrator.context, integrator.record.copy(), integrator.tables, frame)
        return old
