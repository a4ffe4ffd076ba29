"""Sequential shifts of reflected light, after the supplement of paper a: of two lobes one is chosen by chance.

The toy's pixels look at a light in the plane z = 1, seen from z = 0. A sample is a point of the light, found by a
direction of one of two lobes: a diffuse one, or one about the pixel's mirror direction. A round of reconnection keeps
the point; then the lobe is drawn anew by its posterior, and its two numbers follow from the point (probabilistic
inversion of the mixture); a round of replay takes the same numbers to the other pixel's lobe.
"""

import math

import numpy as np

from restir_engine.integrators.resampling.frame import FRAME, Frame, frame_at
from restir_engine.integrators.resampling.inputs import point_at, store_light
from restir_engine.integrators.resampling.options import REUSE, reuse_at
from restir_engine.integrators.resampling.reservoir import clear, reservoir_at, reservoir_dtype
from restir_engine.integrators.resampling.reuse import Reuse
from restir_engine.integrators.resampling.technique import (
    SHIFTED_BYTES,
    domain_at,
    shifted_at,
    store_f,
    technique_row,
)
from restir_engine.kernels.core import rng
from restir_engine.kernels.core.jit import device, entry, inlined, kernel
from restir_engine.kernels.core.memory import address, record_at
from restir_engine.kernels.core.vec import cross, dot, madd, normalize, scale, vec
from restir_engine.kernels.lobes.classes import Lobes
from restir_engine.reuse_settings import ReuseSettings

from .toy_technique import SIZE, Toy, domains, pixel_frame

TWO_LOBES = 9  # TECHNIQUE.id
RESERVOIR = reservoir_dtype(np.dtype([("x", np.float32), ("y", np.float32)]))
sample_at = record_at(RESERVOIR)
PLACE = np.dtype(
    [
        ("p", np.float64, (3,)),
        ("mirror", np.float64, (3,)),  # unit direction
        ("exponent", np.float64),
        ("diffuse", np.float64),  # the chance of the diffuse lobe
        ("weights", np.float64, (2,)),  # of the lobes in the BSDF
    ]
)
place_at = record_at(PLACE)
PLACES = np.array(
    [
        ((-0.3, -0.2, 0.0), (0.36, 0.48, 0.8), 6.0, 0.7, (0.6, 0.3)),
        ((0.2, -0.4, 0.0), (-0.48, 0.36, 0.8), 12.0, 0.4, (0.3, 0.6)),
        ((0.1, 0.3, 0.0), (0.0, -0.6, 0.8), 3.0, 0.5, (0.5, 0.5)),
        ((-0.5, 0.4, 0.0), (0.28, 0.0, 0.96), 20.0, 0.25, (0.2, 0.8)),
    ],
    PLACE,
)
HALF = 1.5  # of the light's side
RIGHT, LOBE_BY_CHANCE, NO_LOBE_RATIO = range(3)  # planted errors: the lobe is redrawn without the point; see `_replay`


@inlined
def _mirror_frame(mirror):
    t = normalize(cross((0.0, 1.0, 0.0), mirror))
    return t, cross(mirror, t)


@inlined
def _towards(place, x, y):
    """(unit direction, distance) from a place to a point of the light's plane."""
    d = (x - place.p[0], y - place.p[1], 1.0)
    r = math.sqrt(dot(d, d))
    return scale(d, 1.0 / r), r


@device
def lobe_density(place, lobe, x, y):
    """The density by area with which a lobe finds a point of the light's plane, without the lobe's chance."""
    d, r = _towards(place, x, y)
    if lobe == 0:
        by_angle = d[2] / math.pi
    else:
        cosine = max(dot(d, vec(place.mirror)), 0.0)
        by_angle = (place.exponent + 1.0) / (2.0 * math.pi) * cosine**place.exponent
    return by_angle * d[2] / (r * r)


@inlined
def _chance(place, lobe):
    return place.diffuse if lobe == 0 else 1.0 - place.diffuse


@inlined
def _density(place, x, y):
    return _chance(place, 0) * lobe_density(place, 0, x, y) + _chance(place, 1) * lobe_density(place, 1, x, y)


@device
def _find(place, lobe, u, v):
    """(whether it is found, x, y): the point of the light's plane that a lobe finds by two numbers."""
    angle = 2.0 * math.pi * v
    if lobe == 0:
        flat = math.sqrt(u)
        d = (flat * math.cos(angle), flat * math.sin(angle), math.sqrt(1.0 - u))
    else:
        cosine = u ** (1.0 / (place.exponent + 1.0))
        sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
        mirror = vec(place.mirror)
        t, b = _mirror_frame(mirror)
        d = madd(madd(scale(mirror, cosine), t, sine * math.cos(angle)), b, sine * math.sin(angle))
    if d[2] < 1.0e-3:
        return False, 0.0, 0.0
    return True, place.p[0] + d[0] / d[2], place.p[1] + d[1] / d[2]


@device
def _numbers(place, lobe, x, y):
    """The two numbers by which a lobe finds a point."""
    d, _ = _towards(place, x, y)
    if lobe == 0:
        u, angle = 1.0 - d[2] * d[2], math.atan2(d[1], d[0])
    else:
        mirror = vec(place.mirror)
        t, b = _mirror_frame(mirror)
        u, angle = max(dot(d, mirror), 0.0) ** (place.exponent + 1.0), math.atan2(dot(d, b), dot(d, t))
    v = angle / (2.0 * math.pi)
    return u, v - math.floor(v)


@device
def integrand(place, x, y):
    """What the place reflects of the light at a point, by area."""
    if abs(x) > HALF or abs(y) > HALF:
        return 0.0
    emitted = 1.0 + 0.9 * math.sin(5.0 * x) * math.cos(4.0 * y)
    return emitted * (place.weights[0] * lobe_density(place, 0, x, y) + place.weights[1] * lobe_density(place, 1, x, y))


@inlined
def _place_of(domain):
    d = domain_at(domain, 0)
    return place_at(point_at(frame_at(d.frame, 0), d.pixel).closures, 0)


@entry
def lobes_target(domain, shifted, a, b, c):
    """f, gray, which is p̂ (see resampling.technique)."""
    r = sample_at(shifted, 0)
    f = integrand(_place_of(domain), float(r.x), float(r.y))
    store_f(shifted, Lobes((f, f, f), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    shifted_at(shifted, 0).target = f


@entry
def reconnect(start, to, reservoir, shifted, unused):
    """The point is kept."""
    shifted_at(shifted, 0).jacobian = 1.0


@inlined
def _replay(start, to, shifted, with_lobes):
    """The lobe and its numbers are kept: |T'| = (p_x(y) / p_x'(y')) (w_x' / w_x), w being the lobe's chance."""
    a, b, r = _place_of(start), _place_of(to), sample_at(shifted, 0)
    lobe, x, y = int(r.flags), float(r.x), float(r.y)
    u, v = _numbers(a, lobe, x, y)
    found, there_x, there_y = _find(b, lobe, u, v)
    # Single precision loses a point whose numbers are nearly those of none: neither way.
    if not found or not 1.0e-5 < u < 1.0 - 1.0e-5:
        return
    r.x = there_x
    r.y = there_y
    ratio = _chance(b, lobe) / _chance(a, lobe) if with_lobes else 1.0
    shifted_at(shifted, 0).jacobian = _density(a, x, y) / _density(b, there_x, there_y) * ratio


@entry
def replay(start, to, reservoir, shifted, unused):
    """The numbers are kept."""
    _replay(start, to, shifted, True)


@entry
def replay_without_lobes(start, to, reservoir, shifted, unused):
    """A planted error."""
    _replay(start, to, shifted, False)


@inlined
def _redraw(domain, shifted, chosen, by_point):
    d = domain_at(domain, 0)
    place, r = _place_of(domain), sample_at(shifted + SHIFTED_BYTES * chosen, 0)
    diffuse = place.diffuse
    if by_point:
        x, y = float(r.x), float(r.y)
        diffuse *= lobe_density(place, 0, x, y) / _density(place, x, y)
    key = rng.hash_combine(rng.hash_combine(reuse_at(d.reuse, 0).seed, d.pixel), 0x4C4F4245)
    r.flags = 0 if rng.sample1(key, 0, 0) < diffuse else 1


@entry
def redraw(domain, shifted, table, n, chosen):
    """The lobe is drawn anew by its posterior (see resampling.technique, merge)."""
    _redraw(domain, shifted, chosen, True)


@entry
def redraw_by_chance(domain, shifted, table, n, chosen):
    """A planted error."""
    _redraw(domain, shifted, chosen, False)


@kernel
def candidates_kernel(frame: FRAME, reuse: REUSE, seed):
    """Fill reservoirs and frame.light."""
    for pixel in range(frame.width * frame.height):
        place = place_at(point_at(frame, pixel).closures, 0)
        key = rng.hash_combine(seed, pixel)
        u, v = rng.sample2(key, 0, 0)
        lobe = 0 if rng.sample1(key, 0, 1) < place.diffuse else 1
        found, x, y = _find(place, lobe, u, v)
        clear(reservoir_at(frame.reservoirs, pixel), 1.0)
        r = sample_at(frame.reservoirs, pixel)
        r.technique = TWO_LOBES
        f = integrand(place, x, y) if found else 0.0
        if f > 0.0:
            r.x = x
            r.y = y
            r.flags = lobe
            r.target = f
            r.contribution_weight = 1.0 / _density(place, x, y)
        store_light(frame, reuse, pixel, Lobes((f, f, f), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))


def posterior(place, points: np.ndarray) -> np.ndarray:
    """The chance that it was the diffuse lobe of a place, a PLACE, that has found points (n, 2): (n,)."""
    diffuse = place["diffuse"] * densities(place, 0, points)
    mirror = (1.0 - place["diffuse"]) * densities(place, 1, points)
    return diffuse / (diffuse + mirror)


def densities(place, lobe: int, points: np.ndarray) -> np.ndarray:
    """`lobe_density` of points (..., 2), from the formula."""
    d = np.concatenate([points, np.ones((*points.shape[:-1], 1))], -1) - place["p"]
    r = np.linalg.norm(d, axis=-1)
    cosine, n = d[..., 2] / r, place["exponent"]
    if lobe == 0:
        return cosine / math.pi * cosine / r**2
    return (n + 1.0) / (2.0 * math.pi) * np.maximum(d @ place["mirror"] / r, 0.0) ** n * cosine / r**2


def integral(place) -> float:
    """What a place reflects, by the midpoint rule."""
    line = ((np.arange(400) + 0.5) / 200.0 - 1.0) * HALF
    points = np.stack(np.meshgrid(line, line), -1)
    emitted = 1.0 + 0.9 * np.sin(5.0 * points[..., 0]) * np.cos(4.0 * points[..., 1])
    reflected = sum(place["weights"][lobe] * densities(place, lobe, points) for lobe in (0, 1))
    return float((emitted * reflected).mean()) * (2.0 * HALF) ** 2


class TwoLobes(Toy):
    """Frames of this technique: a round of reconnection, and, with rounds = 2, one of replay."""

    def __init__(self, settings: ReuseSettings, planted: int = RIGHT) -> None:
        super().__init__(settings)
        shift = replay_without_lobes if planted == NO_LOBE_RATIO else replay
        merge = redraw_by_chance if planted == LOBE_BY_CHANCE else redraw
        first = technique_row(TWO_LOBES, shift=reconnect, merge=merge, target=lobes_target)
        self.reuse = Reuse(settings, first, [technique_row(TWO_LOBES, shift=shift, target=lobes_target)])

    def candidates(self, row: int, seed: int) -> Frame:
        """A frame with candidates alone."""
        frame = pixel_frame(RESERVOIR)
        frame.points["closures"] = address(PLACES) + PLACE.itemsize * domains()
        candidates_kernel(frame.record, self.reuse.records[0], seed)
        return frame

    def integrals(self) -> list[float]:
        """What the places reflect."""
        return [integral(place) for place in PLACES]


__all__ = ["PLACES", "RIGHT", "SIZE", "TwoLobes", "posterior"]
