"""The eyes of a spherical stereo picture: every direction is seen from beside the camera, across that direction.

One picture for all ways that a head may turn (omnidirectional stereo; Ishiguro, Yamamoto and Tsuji 1992). Towards the
poles both eyes may draw together, where there is no side to stand at.
"""

import math

from ..core.jit import device
from ..core.records import CAMERA_PANORAMA, PANORAMA_CYLINDRICAL, PANORAMA_MIRROR_BALL
from ..core.vec import add, cross, dot, normalize, scale, sub


@device
def from_eye(camera, o, d):
    """A ray in camera space as the eye sees it that camera.eye tells: (o, unit d).

    Up is the camera's in a panorama, else the world's. Beyond the convergence distance the eyes' rays part again.
    """
    up = (camera.to_world[8], camera.to_world[9], camera.to_world[10])
    offset = camera.eye
    if camera.kind == CAMERA_PANORAMA:
        up = (0.0, 1.0, 0.0)
        if camera.projection == PANORAMA_MIRROR_BALL:
            offset = -offset  # its picture is a reflection
        elif camera.projection == PANORAMA_CYLINDRICAL:
            # Height and distance go by the cylinder of radius 1, as in Cycles.
            d = scale(d, 1.0 / max(math.sqrt(d[0] * d[0] + d[2] * d[2]), 1e-30))
    side = normalize(cross(d, up))
    moved = scale(side, offset * _apart(camera, dot(d, up)))
    if camera.convergence > 0.0:
        d = sub(scale(d, camera.convergence), moved)
    return add(o, moved), normalize(d)


@device
def _apart(camera, height):
    """How far the eyes are apart, by their distance at the horizon, where they look at the sine of a latitude."""
    start = camera.pole_merge[0]
    end = camera.pole_merge[1]
    latitude = math.asin(min(abs(height), 1.0))
    if end <= 0.0 or latitude <= start:
        return 1.0
    if latitude >= end:
        return 0.0
    return math.cos(0.5 * math.pi * (latitude - start) / (end - start))
