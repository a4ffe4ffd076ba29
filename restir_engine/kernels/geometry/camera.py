"""Camera rays: perspective, orthographic and panoramic, with a lens of finite size."""

import math

from ..core.jit import device, inlined
from ..core.records import CAMERA_ORTHOGRAPHIC, CAMERA_PANORAMA, PANORAMA_MIRROR_BALL
from ..core.vec import add, cross, dot, is_black, length, madd, normalize, scale, sub, transform_point, transform_vector
from .panorama import panorama_direction, panorama_place
from .stereo import from_eye


@device
def camera_ray(camera, x, y, lens_u, lens_v):
    """A ray through the point (x, y) of the film: (o, d, dp, dd).

    x, y: pixels from the film's lower left corner; lens_u, lens_v: uniform numbers. d is a unit vector and o lies on
    the near clipping plane (for a panorama: sphere); d is 0 where a round panorama has no picture. dp is the radius of
    the ray's footprint at o, dd its growth by unit of distance: the mean over both image axes of how fast the direction
    turns by pixel (Igehy 1999, reduced to a cone).
    """
    px = x + camera.region_x
    py = y + camera.region_y
    if camera.kind == CAMERA_PANORAMA:
        o, d, near, dp, dd = _panorama(camera, px, py, lens_u, lens_v)
    elif camera.kind == CAMERA_ORTHOGRAPHIC:
        o, d, near, dp, dd = _orthographic(camera, px, py, lens_u, lens_v)
    else:
        o, d, near, dp, dd = _perspective(camera, px, py, lens_u, lens_v)
    if camera.eye != 0.0 and not is_black(d):
        o, d = from_eye(camera, o, d)
    o = transform_point(camera.to_world, madd(o, d, near))
    return o, transform_vector(camera.to_world, d), dp + near * dd, dd


@device
def camera_reach(camera, d):
    """How far a ray of `camera_ray` with direction d goes before the far clipping plane (for a panorama: sphere).

    Where a surface is baked: nowhere, so that nothing is seen through it.
    """
    if camera.texels != 0:
        return 0.0
    reach = camera.clip_end - camera.clip_start
    if camera.kind != CAMERA_PANORAMA:
        cosine = -(d[0] * camera.to_world[2] + d[1] * camera.to_world[6] + d[2] * camera.to_world[10])
        reach /= max(cosine, 1e-6)
    return reach


@device
def camera_pixel(camera, p):
    """Where a point appears on the film, as seen from the middle of the lens: (seen, x, y), maybe beyond its edges.

    seen: whether it lies in front of the camera (for a panorama: always). Inverse of `camera_ray` without a lens, for
    the eyes of a spherical stereo picture as if they were in the middle as well.
    """
    q = transform_point(camera.to_camera, p)
    if camera.kind == CAMERA_PANORAMA:
        x, y = panorama_place(camera, normalize(q))
    else:
        if q[2] >= 0.0:
            return False, 0.0, 0.0
        away = 1.0 if camera.kind == CAMERA_ORTHOGRAPHIC else -q[2]
        x = (q[0] / away - camera.screen[0]) / (camera.screen[1] - camera.screen[0])
        y = (q[1] / away - camera.screen[2]) / (camera.screen[3] - camera.screen[2])
    return True, x * camera.width - camera.region_x, y * camera.height - camera.region_y


@inlined
def _perspective(camera, px, py, lens_u, lens_v):
    """In camera space: (lens point, unit direction, distance to the near plane, dp, dd)."""
    step_x = (camera.screen[1] - camera.screen[0]) / camera.width
    step_y = (camera.screen[3] - camera.screen[2]) / camera.height
    pinhole = (camera.screen[0] + px * step_x, camera.screen[2] + py * step_y, -1.0)
    squared = dot(pinhole, pinhole)
    distance = math.sqrt(squared)
    d = scale(pinhole, 1.0 / distance)
    # How far the unit direction turns when the pinhole's image moves by a step along x, and along y.
    turn_x = abs(step_x) * math.sqrt(squared - pinhole[0] * pinhole[0])
    turn_y = abs(step_y) * math.sqrt(squared - pinhole[1] * pinhole[1])
    dd = 0.5 * (turn_x + turn_y) / squared
    near = camera.clip_start * distance
    o = (0.0, 0.0, 0.0)
    if camera.aperture > 0.0:
        lens_x, lens_y = _lens_point(camera, lens_u, lens_v)
        o = (lens_x, lens_y, 0.0)
        d = normalize(sub(scale(pinhole, camera.focus_distance), o))
    return o, d, near, 0.0, dd


@device
def _orthographic(camera, px, py, lens_u, lens_v):
    step_x = (camera.screen[1] - camera.screen[0]) / camera.width
    step_y = (camera.screen[3] - camera.screen[2]) / camera.height
    o = (camera.screen[0] + px * step_x, camera.screen[2] + py * step_y, 0.0)
    d = (0.0, 0.0, -1.0)
    near = camera.clip_start
    if camera.aperture > 0.0:
        lens_x, lens_y = _lens_point(camera, lens_u, lens_v)
        d = normalize((-lens_x, -lens_y, -camera.focus_distance))
        o = add(o, (lens_x, lens_y, 0.0))
        near /= max(-d[2], 1e-6)
    return o, d, near, abs(step_x), 0.0


@device
def _panorama(camera, px, py, lens_u, lens_v):
    d = panorama_direction(camera, px / camera.width, py / camera.height)
    right = panorama_direction(camera, (px + 1.0) / camera.width, py / camera.height)
    up = panorama_direction(camera, px / camera.width, (py + 1.0) / camera.height)
    dd = _spread(d, right, up)
    o = (0.0, 0.0, 0.0)
    if camera.aperture > 0.0 and not is_black(d):
        lens_x, lens_y = _lens_point(camera, lens_u, lens_v)
        ahead = (0.0, 0.0, -1.0)
        if camera.projection == PANORAMA_MIRROR_BALL:
            ahead = (1.0, 0.0, 0.0)
        tangent = normalize(madd(ahead, d, -dot(ahead, d)))
        if length(tangent) == 0.0:
            tangent = (0.0, 1.0, 0.0)
        o = madd(scale(tangent, lens_x), cross(d, tangent), lens_y)
        d = normalize(sub(scale(d, camera.focus_distance), o))
    return o, d, camera.clip_start, 0.0, dd


@device
def _spread(d, right, up):
    """Half the sum of the distances from a unit direction to its two neighbours."""
    return 0.5 * (length(sub(right, d)) + length(sub(up, d)))


@device
def _lens_point(camera, u, v):
    """A point of the lens, uniform by area: a disk, or a regular polygon with a side facing the rotation."""
    if camera.blades < 3:
        angle = 2.0 * math.pi * u
        x = math.sqrt(v)
        y = 0.0
    else:
        sector = math.floor(u * camera.blades)
        half = math.pi / camera.blades
        # A triangle of the centre and two corners, mirrored about the axis between them.
        root = math.sqrt(u * camera.blades - sector)
        x = (1.0 - root + v * root) * math.cos(half)
        y = (1.0 - root - v * root) * math.sin(half)
        angle = camera.blade_rotation + 2.0 * half * sector
    cosine = math.cos(angle)
    sine = math.sin(angle)
    return (
        camera.aperture * (cosine * x - sine * y) / camera.aperture_ratio,
        camera.aperture * (sine * x + cosine * y),
    )
