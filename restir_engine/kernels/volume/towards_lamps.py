"""Directions in which a path goes on from a point inside of media, some of them towards a lamp.

What a lamp of intensity I at the distance r scatters into a ray that starts under the angle θ to it is, as far as the
medium is thin, ∫ I / distance² = I (π - θ) / (r sin θ): without bound beside the lamp. Directions by the phase function
p alone meet that with a variance without bound. So one lamp with a place is chosen, and a share α of the directions by
what its light would be:

    q(ω) = (1 - α) p(ω) + α (π - θ) / (π³ sin θ)

Only points and spots inside of an object with a medium are such lamps: beside one that stands outside, or is wide, no
medium is much brighter than elsewhere, and directions would be lost on it (2.5 times the noise of a fog below an area
lamp).

The weight p / q is at most 1 / (1 - α), and goes to 0 beside the lamp as its light grows. Where there are several lamps
each choice gives an estimate of the same mean, and MIS of light that rays find goes by the q of the chosen one.
"""

import math

from ..core.jit import device, inlined
from ..core.records import LIGHT_IN_MEDIUM, SCENE_HAS_PIVOTS, light_at, media_at
from ..core.vec import dot, normalize, put, sub, vec
from .pivot import choose_lamp

_SHARE = 0.5


@device
def choose_target(scene, integrator, media, path, p, u):
    """Choose by u the lamp that directions at p are led towards, and leave it and its share in MEDIA."""
    m = media_at(media, 0)
    m.share = 0.0
    ends = path.bounce + 1 >= integrator.max_bounces or path.volume_bounce + 1 >= integrator.volume_bounces
    if not scene.flags & SCENE_HAS_PIVOTS or ends or path.last:
        return
    chosen = choose_lamp(scene, p, (0.0, 0.0, 1.0), 0.0, u)
    if chosen < 0 or not light_at(scene.lights, chosen).flags & LIGHT_IN_MEDIUM:
        return
    to = normalize(sub(vec(light_at(scene.lights, chosen).center), p))
    put(m.target, to)
    m.share = _SHARE if dot(to, to) > 0.0 else 0.0


@inlined
def target_angle(u):
    """The angle θ to MEDIA.target at u of the cumulative distribution (2 θ - θ² / π) / π."""
    return math.pi * (1.0 - math.sqrt(1.0 - u))


@inlined
def target_density(media, wi):
    """Its density by solid angle, (π - θ) / (π³ sin θ)."""
    cosine = dot(vec(media_at(media, 0).target), wi)
    sine = math.sqrt(max(1.0 - cosine * cosine, 1.0e-12))
    return (math.pi - math.atan2(sine, cosine)) / (math.pi**3 * sine)
