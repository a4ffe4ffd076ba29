"""Light on shadow catchers, with and without all else: two paths from each point that is seen of one.

Both have the same random numbers: where there is no shadow they find the same light, and their ratio has no noise. See
docs/shadow-catchers.md.
"""

from __future__ import annotations

import numpy as np

from ...context import FrameContext
from ...film import Film
from ...kernels.core.memory import address
from ...settings import BARE_CATCHER, SHADOW_CATCHER
from .tile import render_tile


class Catchers:
    """Adds what the shadow catchers of a frame receive to a film, a tile at a time.

    integrator: INTEGRATOR record (1,), whose light below surfaces nobody caches.
    """

    kernels = [render_tile]

    def __init__(self, context: FrameContext, integrator: np.ndarray, film: Film) -> None:
        scene, camera = context.scene, context.camera
        self._integrator = integrator
        self._bare = FrameContext(scene.bare, camera)
        frames = FrameContext(scene, camera), FrameContext(scene, camera, caught=self._bare)
        self._runs = list(zip(frames, map(film.caught_record, (SHADOW_CATCHER, BARE_CATCHER)), strict=True))
        self._film = film

    def render(self, tile: tuple[int, int, int, int], scratch: np.ndarray, first_sample: int, samples: int) -> None:
        """Add so many samples of the pixels of a tile."""
        for frame, record in self._runs:
            record["active"] = self._film.record["active"]
            args = frame.record, frame.camera_record, self._integrator[0], record[0]
            render_tile(*args, address(scratch), *tile, first_sample, samples)
