"""Panoramas: where a place of the frame looks, and where a direction appears in it.

Places are from 0 to 1 across the whole frame; directions are of unit length in camera space, which looks along -z with
y up. As Cycles has them (kernel/camera/projection.h).
"""

import math

from ..core.jit import device
from ..core.records import (
    PANORAMA_CUBE_FACE,
    PANORAMA_CYLINDRICAL,
    PANORAMA_EQUIDISTANT,
    PANORAMA_EQUIRECTANGULAR,
    PANORAMA_EQUISOLID,
    PANORAMA_MIRROR_BALL,
)
from ..core.vec import normalize

_NEWTON_STEPS = 20
NOWHERE = (0.0, 0.0, 0.0)


@device
def panorama_direction(camera, u, v):
    """The direction that a place of the frame looks in; NOWHERE outside of a round picture."""
    kind = camera.projection
    if kind in (PANORAMA_EQUIRECTANGULAR, PANORAMA_CYLINDRICAL):
        x = camera.panorama[0] + (camera.panorama[1] - camera.panorama[0]) * u
        y = camera.panorama[2] + (camera.panorama[3] - camera.panorama[2]) * v
        if kind == PANORAMA_CYLINDRICAL:
            return normalize((math.sin(x), y, -math.cos(x)))
        flat = math.cos(y)
        return (flat * math.sin(x), math.sin(y), -flat * math.cos(x))
    if kind == PANORAMA_CUBE_FACE:
        return normalize((math.tan((u - 0.5) * 0.5 * math.pi), math.tan((v - 0.5) * 0.5 * math.pi), -1.0))
    if kind == PANORAMA_MIRROR_BALL:
        x, y = 2.0 * u - 1.0, 2.0 * v - 1.0
        squared = 1.0 - x * x - y * y
        if squared < 0.0:
            return NOWHERE
        z = math.sqrt(squared)  # the ball's normal, mirroring what looks at it along z
        return (2.0 * z * x, 2.0 * z * y, 1.0 - 2.0 * z * z)
    return _fisheye(camera, u, v)


@device
def _fisheye(camera, u, v):
    """A lens whose picture of a direction lies the farther from the middle the farther it is from the axis."""
    fov = camera.fisheye[0]
    if camera.projection == PANORAMA_EQUIDISTANT:
        x, y = 2.0 * u - 1.0, 2.0 * v - 1.0
        r = math.sqrt(x * x + y * y)
        theta = 0.5 * fov * r
        inside = r <= 1.0
    else:
        x, y = (u - 0.5) * camera.fisheye[2], (v - 0.5) * camera.fisheye[3]
        r = math.sqrt(x * x + y * y)
        if camera.projection == PANORAMA_EQUISOLID:
            inside = r <= 2.0 * camera.fisheye[1] * math.sin(0.25 * fov)
            theta = 2.0 * math.asin(min(r / (2.0 * camera.fisheye[1]), 1.0))
        else:
            theta = -_polynomial(camera, r)
            inside = abs(theta) <= 0.5 * fov
    if not inside:
        return NOWHERE
    if r == 0.0:
        # As Cycles, whose angle about the axis is that of a cosine of 0.
        return (0.0, math.sin(theta), -math.cos(theta))
    s = math.sin(theta) / r
    return (s * x, s * y, -math.cos(theta))


@device
def _polynomial(camera, r):
    k = camera.polynomial
    return k[0] + r * (k[1] + r * (k[2] + r * (k[3] + r * k[4])))


@device
def panorama_place(camera, d):
    """Where a direction appears in the frame: (u, v), maybe beyond its edges."""
    kind = camera.projection
    if kind in (PANORAMA_EQUIRECTANGULAR, PANORAMA_CYLINDRICAL):
        flat = math.sqrt(d[0] * d[0] + d[2] * d[2])
        y = d[1] / max(flat, 1e-30) if kind == PANORAMA_CYLINDRICAL else math.atan2(d[1], flat)
        x = math.atan2(d[0], -d[2])
        return (
            (x - camera.panorama[0]) / (camera.panorama[1] - camera.panorama[0]),
            (y - camera.panorama[2]) / (camera.panorama[3] - camera.panorama[2]),
        )
    if kind == PANORAMA_CUBE_FACE:
        step = 2.0 / math.pi
        return 0.5 + math.atan2(d[0], -d[2]) * step, 0.5 + math.atan2(d[1], -d[2]) * step
    if kind == PANORAMA_MIRROR_BALL:
        # Half way between the direction and the eye that looks at the ball.
        z = d[2] - 1.0
        half = max(2.0 * math.sqrt(max(-0.5 * z, 0.0)), 1e-30)
        return 0.5 * (d[0] / half + 1.0), 0.5 * (d[1] / half + 1.0)
    theta = math.acos(min(max(-d[2], -1.0), 1.0))
    across = max(math.sqrt(d[0] * d[0] + d[1] * d[1]), 1e-30)
    if kind == PANORAMA_EQUIDISTANT:
        r = theta / camera.fisheye[0]
        return 0.5 + r * d[0] / across, 0.5 + r * d[1] / across
    if kind == PANORAMA_EQUISOLID:
        r = 2.0 * camera.fisheye[1] * math.sin(0.5 * theta)
    else:
        r = _radius_of(camera, theta)
    return 0.5 + r * d[0] / (across * camera.fisheye[2]), 0.5 + r * d[1] / (across * camera.fisheye[3])


@device
def _radius_of(camera, theta):
    """How far from the middle a polynomial lens shows an angle to its axis, by Newton's method."""
    k = camera.polynomial
    r = (-theta - k[0]) / k[1] if k[1] != 0.0 else 1.0
    for _ in range(_NEWTON_STEPS):
        slope = k[1] + r * (2.0 * k[2] + r * (3.0 * k[3] + r * 4.0 * k[4]))
        if slope == 0.0:
            break
        step = (-theta - _polynomial(camera, r)) / slope
        r += step
        if abs(step) < 1e-6:
            break
    return r
