"""Shifts of subsurface paths between the pixels of a frame, called from Python."""

from __future__ import annotations

import numpy as np

from restir_engine.context import FrameContext
from restir_engine.film import Film
from restir_engine.integrators.resampling.frame import FRAME
from restir_engine.integrators.resampling.inputs import domain_of
from restir_engine.integrators.resampling.options import REUSE
from restir_engine.integrators.resampling.reservoir import RESERVOIR_BYTES
from restir_engine.integrators.resampling.technique import (
    NOW,
    SHIFTED,
    SHIFTED_BYTES,
    domain_at,
    set_domain,
    shift,
)
from restir_engine.integrators.restir.integrator import RestirIntegrator
from restir_engine.integrators.techniques.subsurface import invert
from restir_engine.integrators.techniques.subsurface.invert import PAIRS, choice_density
from restir_engine.integrators.techniques.subsurface.sample import SUBSURFACE_RESERVOIR, point_of, sample_at
from restir_engine.integrators.techniques.subsurface.target import place_of
from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.core.memory import address, call_entry, load_i64, store_f64
from restir_engine.kernels.core.records import INTEGRATOR, SCENE
from restir_engine.kernels.core.vec import store3_f64, sub, vec
from restir_engine.kernels.subsurface.bssrdf import bssrdf_at, diffused_pdf
from restir_engine.settings import RenderSettings, required_passes


@kernel
def shift_kernel(
    scene: SCENE, integrator: INTEGRATOR, frame: FRAME, reuse: REUSE, scratch, starts, tos, reservoirs, count, out
):
    """Shift `count` reservoirs from pixels `starts` to pixels `tos`: SHIFTED at the address `out`."""
    for i in range(2):
        set_domain(domain_at(domain_of(scratch, i), 0), scene, integrator, frame, 0, reuse, scratch, NOW)
    for k in range(count):
        domain_at(domain_of(scratch, 0), 0).pixel = load_i64(starts, k)
        domain_at(domain_of(scratch, 1), 0).pixel = load_i64(tos, k)
        reservoir = reservoirs + RESERVOIR_BYTES * k
        shift(reuse, domain_of(scratch, 0), domain_of(scratch, 1), reservoir, out + SHIFTED_BYTES * k)


@kernel
def redraw_kernel(
    scene: SCENE, integrator: INTEGRATOR, frame: FRAME, reuse: REUSE, scratch, code, pixels, shifted, count
):
    """Let the code of a technique's `merge` run for one sample a pixel, SHIFTED [count]."""
    set_domain(domain_at(domain_of(scratch, 0), 0), scene, integrator, frame, 0, reuse, scratch, NOW)
    for k in range(count):
        domain_at(domain_of(scratch, 0), 0).pixel = load_i64(pixels, k)
        call_entry(code, domain_of(scratch, 0), shifted + SHIFTED_BYTES * k, 0, 1, 0)


@kernel
def place_kernel(scene: SCENE, frame: FRAME, pixels, reservoirs, count, out):
    """Of samples in their pixels: x₂, its density, and that of each line and channel; float64 [count, 4 + PAIRS]."""
    for k in range(count):
        r = sample_at(reservoirs, k)
        b = bssrdf_at(point_of(frame, load_i64(pixels, k)), 0)
        x, n = place_of(scene, r)
        row = out + 8 * (4 + PAIRS) * k
        offset = sub(x, vec(b.p))
        store3_f64(row, 0, x)
        store_f64(row, 3, diffused_pdf(b, offset, n))
        for pair in range(PAIRS):
            store_f64(row, 4 + pair, choice_density(b, offset, n, pair // 3, pair % 3))


class LayerShifts:
    """The candidates of a layer of RESTIR (see RestirIntegrator.layers) in a frame, and shifts between its pixels."""

    def __init__(self, scene, layer: str, turn: int = 0, **settings) -> None:
        """turn: of which round of reuse the shifts are."""
        settings = RenderSettings(integrator="RESTIR", max_bounces=0, pixel_filter="BOX", **settings)
        width, height = scene.camera.film_size
        self.film = Film(width, height, required_passes(settings.passes, False), 1.0)
        self.integrator = RestirIntegrator(FrameContext(scene), settings, self.film)
        self.frame = self.integrator.frame.companions[layer]
        self.reuse = getattr(self.integrator, layer).reuse.by_round[turn][0]
        self.scratch = self.integrator.scratch()
        for stage in self.integrator.stages(0, 1):
            if "_spatial" in repr(stage.run):
                break
            for item in stage.items or [(0, 0, width, height)]:
                stage.run(item, self.scratch)
        self.reservoirs = self.frame.reservoirs[0].reshape(-1)
        self.lit = np.flatnonzero(self.reservoirs["contribution_weight"] > 0.0)
        self.domains = np.flatnonzero(self.reservoirs["confidence"] > 0.0)

    @property
    def _records(self) -> tuple:
        return self.integrator.context.record, self.integrator.record[0], self.frame.record

    def shift(self, starts, tos, reservoirs) -> np.ndarray:
        """SHIFTED (n,) of the samples of reservoirs (n,) of pixels `starts`, as pixels `tos` have them."""
        starts, tos = (np.ascontiguousarray(a, np.int64) for a in (starts, tos))
        reservoirs = np.ascontiguousarray(reservoirs)
        out = np.zeros(len(starts), SHIFTED)
        shift_kernel(
            *self._records, self.reuse, address(self.scratch), address(starts), address(tos), address(reservoirs),
            len(starts), address(out),
        )  # fmt: skip
        return out


class Shifts(LayerShifts):
    """Those of a round of `sss_shift`."""

    def __init__(self, scene, sss_shift: str, method: str = "DIFFUSION", turn: int = 0, seed: int = 1) -> None:
        super().__init__(scene, "subsurface", turn, seed=seed, sss_method=method, sss_shift=sss_shift)

    def redrawn(self, pixels) -> np.ndarray:
        """Reservoirs (n,) of pixels with line, channel and hit drawn anew."""
        pixels = np.ascontiguousarray(pixels, np.int64)
        shifted = np.zeros(len(pixels), SHIFTED)
        samples(shifted)[:] = self.reservoirs[pixels]
        code = invert.redraw_numbers.address
        redraw_kernel(
            *self._records, self.reuse, address(self.scratch), code, address(pixels), address(shifted), len(pixels)
        )
        return samples(shifted).copy()

    def places(self, pixels, reservoirs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """x₂ (n, 3), its density (n,), and those of each line and channel (n, PAIRS) of samples in their pixels."""
        pixels, reservoirs = np.ascontiguousarray(pixels, np.int64), np.ascontiguousarray(reservoirs)
        out = np.zeros((len(pixels), 4 + PAIRS))
        scene, _, frame = self._records
        place_kernel(scene, frame, address(pixels), address(reservoirs), len(pixels), address(out))
        return out[:, :3], out[:, 3], out[:, 4:]


def samples(shifted: np.ndarray) -> np.ndarray:
    """The reservoirs of SHIFTED (n,), a view."""
    return shifted["reservoir"].view(SUBSURFACE_RESERVOIR)[:, 0]
