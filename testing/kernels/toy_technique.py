"""The toy of `reuse_toy` as a technique beside direct light: its samples run through the kernels that reuse light.

A frame repeats the PIXELS places of the toy as a pattern of 2 × 2 pixels, before and now from other places. The
shading point of a pixel holds the address of its row in WORLDS in place of closures.
"""

import math

import numpy as np

from restir_engine.context import FrameContext
from restir_engine.integrators.resampling.frame import FRAME, Frame, frame_at
from restir_engine.integrators.resampling.history import Before, History
from restir_engine.integrators.resampling.inputs import point_at, store_light
from restir_engine.integrators.resampling.options import REUSE
from restir_engine.integrators.resampling.reservoir import clear, reservoir_at, reservoir_dtype
from restir_engine.integrators.resampling.reuse import Reuse
from restir_engine.integrators.resampling.technique import domain_at, shifted_at, store_f, technique_row
from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import entry, inlined, kernel
from restir_engine.kernels.core.memory import address, record_at
from restir_engine.kernels.core.records import INTEGRATOR, SCRATCH_BYTES
from restir_engine.kernels.lobes.classes import Lobes
from restir_engine.reuse_settings import ReuseSettings

from ..scenes.lights import matrix
from ..scenes.rooms import Builder, diffuse, look, scaled
from ..scenes.shapes import QUAD
from . import reuse_toy as toy

TOY = 2  # TECHNIQUE.id
RESERVOIR = reservoir_dtype(np.dtype([("theta", np.float32), ("phi", np.float32)]))
toy_reservoir_at = record_at(RESERVOIR)

# The places from which the same pixels look a frame before, and how far they see.
PLACES_BEFORE = toy.PLACES + np.array([[0.15, 0.2], [-0.25, 0.1], [0.1, -0.3], [-0.2, -0.2]])
REACH_BEFORE = np.array([0.9, 1.2, 1.0, 1.15])
WORLDS = np.concatenate([toy.WORLD, np.column_stack([PLACES_BEFORE, REACH_BEFORE])])  # now, then before
ROW_BYTES = 24
SIZE = 64


@inlined
def _world(domain):
    d = domain_at(domain, 0)
    return point_at(frame_at(d.frame, 0), d.pixel).closures


@entry
def toy_shift(start, to, reservoir, shifted, unused):
    """The shift of the toy, whose Jacobian is real, see resampling.technique."""
    a, b = _world(start), _world(to)
    r = toy_reservoir_at(shifted, 0)
    valid, theta, phi, jacobian = toy.shift(a, 0, (b - a) // ROW_BYTES, float(r.theta), float(r.phi))
    if valid:
        r.theta = theta
        r.phi = phi
        shifted_at(shifted, 0).jacobian = jacobian


@entry
def toy_shift_without_jacobian(start, to, reservoir, shifted, unused):
    """A planted error."""
    a, b = _world(start), _world(to)
    r = toy_reservoir_at(shifted, 0)
    valid, theta, phi, _ = toy.shift(a, 0, (b - a) // ROW_BYTES, float(r.theta), float(r.phi))
    if valid:
        r.theta = theta
        r.phi = phi
        shifted_at(shifted, 0).jacobian = 1.0


@entry
def toy_target(domain, shifted, a, b, c):
    """f, gray and diffuse, and a p̂ that is unlike it."""
    world = _world(domain)
    r = toy_reservoir_at(shifted, 0)
    theta, phi = float(r.theta), float(r.phi)
    f = toy.integrand(world, 0, theta, phi)
    store_f(shifted, Lobes((f, f, f), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    shifted_at(shifted, 0).target = toy.target(world, 0, theta, phi, 0)


@kernel
def candidates_kernel(frame: FRAME, reuse: REUSE, seed, fail, planted):
    """Fill reservoirs and frame.light; a share `fail` of the candidates fails."""
    for pixel in range(frame.width * frame.height):
        world = point_at(frame, pixel).closures
        key = rng.hash_combine(seed, pixel)
        theta, phi, w = toy.initial(world, 0, key, 0, 0, fail)
        clear(reservoir_at(frame.reservoirs, pixel), 1.0)
        r = toy_reservoir_at(frame.reservoirs, pixel)
        r.technique = TOY
        f = 0.0
        if w > 0.0:
            f = toy.integrand(world, 0, theta, phi)
            r.theta = theta
            r.phi = phi
            r.target = toy.target(world, 0, theta, phi, 0)
            r.contribution_weight = w * r.target if planted == toy.WEIGHT_UNSCALED else w
        elif planted == toy.NULL_UNCOUNTED:
            r.confidence = 1.0e-6  # of 0 it would be a pixel without a domain
        store_light(frame, reuse, pixel, Lobes((f, f, f), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))


def _scene():
    """A floor under a camera that looks down on it; the toy's pixels are points of its first triangle's plane."""
    b = Builder()
    b.add(QUAD, diffuse((0.5, 0.5, 0.5)), scaled(matrix(), 1.0, 1.0, 1.0))
    return b.finish(look((0.0, -0.01, 3.0), (0.0, 0.0, 0.0), SIZE))


def _frame(row: int) -> Frame:
    """A frame whose pixels are the toy's, with the worlds from a row on."""
    frame = pixel_frame(RESERVOIR)
    frame.points["closures"] = address(WORLDS) + ROW_BYTES * (domains() + row)
    return frame


def pixel_frame(reservoir: np.dtype) -> Frame:
    """A frame whose pixels are where the toy's are; what they point to is still missing."""
    frame = Frame(SIZE, SIZE, 1, np.zeros((SIZE, SIZE, 4), np.float32), reservoir)
    x, y = np.moveaxis(toy.PLACES[domains()], -1, 0)
    points = frame.points
    points["instance"], points["n"], points["t"] = 0, (0.0, 0.0, 1.0), 3.0
    points["p"] = np.stack([x, y, np.zeros_like(x)], -1)
    points["u"], points["v"] = 0.5 * (x - y), 0.5 * (y + 1.0)  # of the triangle (-1, -1), (1, -1), (1, 1)
    return frame


def domains() -> np.ndarray:
    """Which of the toy's pixels each pixel of a frame is: int (SIZE, SIZE)."""
    y, x = np.mgrid[:SIZE, :SIZE]
    return x % 2 + 2 * (y % 2)


class Toy:
    """Frames of the toy, reused by the production's stages as `settings` say."""

    def __init__(self, settings: ReuseSettings, planted: int = toy.NO_ERROR, fail: float = 0.0) -> None:
        self.settings, self.planted, self.fail = settings, planted, fail
        shift = toy_shift_without_jacobian if planted == toy.NO_JACOBIAN else toy_shift
        self.reuse = Reuse(settings, technique_row(TOY, shift=shift, target=toy_target))
        self.context = FrameContext(_scene())
        self.integrator = np.zeros(1, INTEGRATOR)
        self._block = np.zeros(SCRATCH_BYTES + 64, np.uint8)
        self.scratch = self._block[-address(self._block) % 64 :]

    def candidates(self, row: int, seed: int) -> Frame:
        """A frame with candidates alone."""
        frame = _frame(row)
        reuse = self.reuse.records[0]
        candidates_kernel(frame.record, reuse, seed, self.fail, self.planted)
        return frame

    def frame(self, seed: int) -> Frame:
        """A frame after all reuse."""
        history = History(self.settings)
        if self.settings.temporal:
            before = self.candidates(toy.PIXELS, rng_seed(seed, 1))
            history.before = Before(self.context, self.integrator, (), before)
        frame = self.candidates(0, rng_seed(seed, 0))
        args = self.context, self.integrator, frame, history, rng_seed(seed, 2)
        for stage in self.reuse.stages(*args):
            for y in range(0, SIZE, 32):
                for x in range(0, SIZE, 32):
                    stage.run((x, y, x + 32, y + 32), self.scratch)
            stage.finish()
        return frame

    def integrals(self) -> list[float]:
        """The truth of each of the toy's pixels."""
        return [toy.integral(i) for i in range(toy.PIXELS)]

    def z_scores(self, seeds: int, first: int = 0) -> np.ndarray:
        """How far the means of the pixels' light are from the integrals, in standard errors, for each of the toy's."""
        which = domains()
        means = []
        for seed in range(first, first + seeds):
            light = self.frame(seed).light[..., 0].astype(float)
            means.append([light[which == i].mean() for i in range(toy.PIXELS)])
        means = np.array(means)
        return (means.mean(0) - self.integrals()) / (means.std(0, ddof=1) / math.sqrt(seeds))


def rng_seed(seed: int, stream: int) -> int:
    """A seed of 31 bits."""
    return (seed * 0x9E3779B1 + stream * 0x85EBCA6B + 1) & 0x7FFFFFFF
