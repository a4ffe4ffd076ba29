"""Whole paths of one frame, shifted from pixel to pixel: what tests of the shift look at."""

import numpy as np

from restir_engine.context import FrameContext
from restir_engine.film import Film
from restir_engine.integrators.resampling.frame import FRAME
from restir_engine.integrators.resampling.inputs import domain_of, put_canonical, shifted_of
from restir_engine.integrators.resampling.options import REUSE
from restir_engine.integrators.resampling.reservoir import RESERVOIR_BYTES
from restir_engine.integrators.resampling.technique import NOW, SHIFTED, domain_at, set_domain, shift
from restir_engine.integrators.resampling.vertex import let_go
from restir_engine.integrators.restir.integrator import RestirIntegrator
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, copy_words
from restir_engine.kernels.core.records import INTEGRATOR, SCENE
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.settings import RenderSettings, required_passes

_SHIFTED_WORDS = SHIFTED.itemsize // 8


@kernel
def _shift_all(scene: SCENE, integrator: INTEGRATOR, frame: FRAME, reuse: REUSE, scratch, dx, dy, there, back):
    """Each pixel's sample shifted by (dx, dy), and that shifted back: SHIFTED [height, width] each."""
    let_go(scratch)
    for i in range(2):
        set_domain(domain_at(domain_of(scratch, i), 0), scene, integrator, frame, 0, reuse, scratch, NOW)
    for y in range(frame.height):
        for x in range(frame.width):
            if not (0 <= x + dx < frame.width and 0 <= y + dy < frame.height):
                continue
            pixel = y * frame.width + x
            other = (y + dy) * frame.width + x + dx
            domain_at(domain_of(scratch, 0), 0).pixel = pixel
            domain_at(domain_of(scratch, 1), 0).pixel = other
            put_canonical(frame, scratch, pixel, frame.reservoirs + RESERVOIR_BYTES * pixel)
            first, second = shifted_of(scratch, 0), shifted_of(scratch, 1)
            shift(reuse, domain_of(scratch, 0), domain_of(scratch, 1), first, second)
            copy_words(there + 8 * _SHIFTED_WORDS * pixel, second, _SHIFTED_WORDS)
            shift(reuse, domain_of(scratch, 1), domain_of(scratch, 0), second, shifted_of(scratch, 2))
            copy_words(back + 8 * _SHIFTED_WORDS * pixel, shifted_of(scratch, 2), _SHIFTED_WORDS)


class Paths:
    """The samples of one frame of a scene, `reservoirs` and their F in `light`, before any reuse."""

    def __init__(self, scene, seed: int = 0, **options) -> None:
        reuse = ReuseSettings(**{"paths": "WHOLE", "rounds": 1, "pattern": "DISK"} | options)
        settings = RenderSettings(integrator="RESTIR", seed=seed, reuse=reuse)
        width, height = scene.camera.film_size
        film = Film(width, height, required_passes(settings.passes, False), 1.0)
        self.integrator = RestirIntegrator(FrameContext(scene), settings, film)
        self.integrator.prepare()
        self.scratch = self.integrator.scratch()
        tiles = [
            (x, y, min(x + 32, width), min(y + 32, height)) for y in range(0, height, 32) for x in range(0, width, 32)
        ]
        for stage in self.integrator.stages(0, 1):
            if stage.run.func.__name__ == "_spatial":
                break
            for item in stage.items or tiles:
                stage.run(item, self.scratch)
        self.reservoirs = self.integrator.frame.reservoirs[0]
        self.light = self.integrator.frame.light

    def shifted(self, dx: int, dy: int) -> tuple[np.ndarray, np.ndarray]:
        """SHIFTED (height, width) of each pixel's sample in the pixel by (dx, dy) beside it, and of that back again."""
        own = self.integrator
        there, back = (np.zeros(self.reservoirs.shape, SHIFTED) for _ in range(2))
        _shift_all(
            own.context.record, own.record[0], own.frame.record, own.reuse.records[0], address(self.scratch), dx, dy,
            address(there), address(back),
        )  # fmt: skip
        return there, back

    @property
    def kinds(self) -> np.ndarray:
        """How each sample is shifted (techniques.path.sample.kind_of); -1: a null sample."""
        return np.where(self.reservoirs["contribution_weight"] > 0.0, (self.reservoirs["flags"] >> 9) & 3, -1)
