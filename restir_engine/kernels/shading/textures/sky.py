"""Sky Texture: atmospheres that `scene.sky` has computed into a table, and the closed formula of Preetham."""

import math

from ...core.jit import device, entry
from ...core.memory import load_f32, load_i32
from ...core.records import image_at, scene_at
from ...core.vec import store3_f64
from ..operands import triple
from .image import EXTEND, bilinear
from .rounding import floor

PERCEPTUAL, HALF_DOME, FULL_DOME = 0, 1, 2

# Places in the table of parameters of a dome.
BOTTOM, TOP, ELEVATION, ROTATION, DIAMETER, INTENSITY, HORIZON = 0, 3, 6, 7, 8, 9, 10


@device
def _dome_color(scene, index, x, y):
    color = bilinear(image_at(scene.images, index), EXTEND, x - floor(x), y)
    return (color[0], color[1], color[2])


@device
def _sun_angle(table, d):
    """The angle between a unit direction and the centre of the sun, exact for small angles."""
    elevation, rotation = load_f32(table, ELEVATION), load_f32(table, ROTATION)
    x, y = -math.cos(elevation) * math.sin(rotation), math.cos(elevation) * math.cos(rotation)
    z = math.sin(elevation)
    minus = (d[0] - x) * (d[0] - x) + (d[1] - y) * (d[1] - y) + (d[2] - z) * (d[2] - z)
    plus = (d[0] + x) * (d[0] + x) + (d[1] + y) * (d[1] + y) + (d[2] + z) * (d[2] + z)
    return 2.0 * math.atan2(math.sqrt(minus), math.sqrt(plus))


@device
def _disc_color(table, y, angle):
    """Radiance of the sun's disc at height y in [0, 1] of the disc; darker towards the limb."""
    half = 0.5 * load_f32(table, DIAMETER)
    limb = 1.0 - 0.6 * (1.0 - math.sqrt(max(1.0 - (angle / half) * (angle / half), 0.0)))
    s = load_f32(table, INTENSITY) * limb
    return (
        s * (load_f32(table, BOTTOM) * (1.0 - y) + load_f32(table, TOP) * y),
        s * (load_f32(table, BOTTOM + 1) * (1.0 - y) + load_f32(table, TOP + 1) * y),
        s * (load_f32(table, BOTTOM + 2) * (1.0 - y) + load_f32(table, TOP + 2) * y),
    )


@device
def _half_dome(scene, index, table, d):
    """Blender 4's atmosphere: a table of the upper half, the ground fades to black."""
    elevation = 0.5 * math.pi - math.acos(min(max(d[2], -1.0), 1.0))
    x = (-math.atan2(d[1], d[0]) - 0.5 * math.pi + load_f32(table, ROTATION)) / (2.0 * math.pi)
    if d[2] < 0.0:
        fade = max(1.0 + 2.5 * d[2], 0.0)
        fade = fade * fade * fade
        c = _dome_color(scene, index, x, -0.5)
        return (c[0] * fade, c[1] * fade, c[2] * fade)
    half = 0.5 * load_f32(table, DIAMETER)
    angle = _sun_angle(table, d)
    if half > 0.0 and angle < half:
        sun = load_f32(table, ELEVATION)
        if sun - half > 0.0:
            return _disc_color(table, 0.5 * (elevation - sun) / half + 0.5, angle)
        if sun + half > 0.0:
            return _disc_color(table, elevation / (sun + half), angle)
        return (0.0, 0.0, 0.0)
    return _dome_color(scene, index, x, math.sqrt(max(elevation, 0.0) * 2.0 / math.pi))


@device
def _full_dome(scene, index, table, d):
    """Blender 5's atmosphere: a table of all directions, the sun's disc on top of it."""
    elevation = 0.5 * math.pi - math.acos(min(max(d[2], -1.0), 1.0))
    x = (-math.atan2(d[1], d[0]) - 0.5 * math.pi + load_f32(table, ROTATION)) / (2.0 * math.pi)
    y = 0.5 + 0.5 * math.copysign(math.sqrt(abs(elevation) * 2.0 / math.pi), elevation)
    color = _dome_color(scene, index, x, y)
    half = 0.5 * load_f32(table, DIAMETER)
    if half > 0.0 and elevation > load_f32(table, HORIZON):
        angle = _sun_angle(table, d)
        if angle < half:
            disc = _disc_color(table, 0.5 * (elevation - load_f32(table, ELEVATION)) / half + 0.5, angle)
            color = (color[0] + disc[0], color[1] + disc[1], color[2] + disc[2])
    return color


@device
def _luminance_formula(table, at, theta, gamma):
    """F(θ, γ) of Perez et al. 1993 as Preetham et al. 1999 use it, times its scale; six parameters from `at` on."""
    a, b, c = load_f32(table, at), load_f32(table, at + 1), load_f32(table, at + 2)
    d, e = load_f32(table, at + 3), load_f32(table, at + 4)
    cosine = math.cos(gamma)
    horizon = 1.0 + a * math.exp(b / max(math.cos(theta), 1e-4))
    return load_f32(table, at + 5) * horizon * (1.0 + c * math.exp(d * gamma) + e * cosine * cosine)


@device
def _perceptual(table, d):
    """Preetham's sky: the table holds the sun's θ and φ and six parameters each for Y, x and y; then XYZ to RGB."""
    theta = math.acos(min(max(d[2], -1.0), 1.0))
    phi = math.atan2(d[0], d[1])
    sun_theta, sun_phi = load_f32(table, 0), load_f32(table, 1)
    cosine = math.sin(theta) * math.sin(sun_theta) * math.cos(phi - sun_phi) + math.cos(theta) * math.cos(sun_theta)
    gamma = math.acos(min(max(cosine, -1.0), 1.0))
    theta = min(theta, 0.5 * math.pi - 0.001)
    luminance = _luminance_formula(table, 2, theta, gamma)
    x = _luminance_formula(table, 8, theta, gamma)
    y = _luminance_formula(table, 14, theta, gamma)
    scale = luminance / y if y != 0.0 else 0.0
    return (x * scale, luminance, (1.0 - x - y) * scale)


@device
def _to_rgb(table, at, c):
    return (
        load_f32(table, at) * c[0] + load_f32(table, at + 1) * c[1] + load_f32(table, at + 2) * c[2],
        load_f32(table, at + 3) * c[0] + load_f32(table, at + 4) * c[1] + load_f32(table, at + 5) * c[2],
        load_f32(table, at + 6) * c[0] + load_f32(table, at + 7) * c[1] + load_f32(table, at + 8) * c[2],
    )


@entry
def sky_op(scene, _sp, registers, code, at):
    """Sky Texture: see opcodes.SKY."""
    scene = scene_at(scene, 0)
    d = triple(registers, code, at + 1)
    index = load_i32(code, at + 2)
    table = scene.tables + 4 * load_i32(code, at + 3)
    kind = load_i32(code, at + 4)
    if kind == HALF_DOME:
        c = _half_dome(scene, index, table, d)
    elif kind == FULL_DOME:
        c = _full_dome(scene, index, table, d)
    else:
        c = _to_rgb(table, 20, _perceptual(table, d))
    store3_f64(registers, load_i32(code, at), (max(c[0], 0.0), max(c[1], 0.0), max(c[2], 0.0)))
