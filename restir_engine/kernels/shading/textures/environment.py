"""Environment Texture: a direction looks up an equirectangular map or the photograph of a mirror ball."""

import math

from ...core.jit import device, entry
from ...core.memory import load_i32, store_f64
from ...core.records import scene_at
from ...core.vec import normalize, store3_f64
from ..operands import triple
from .image import image_lookup

EQUIRECTANGULAR, MIRROR_BALL = 0, 1


@device
def equirectangular(d):
    """(u, v) of a unit direction: u falls with the longitude from +x, v rises with the latitude."""
    if d[0] == 0.0 and d[1] == 0.0 and d[2] == 0.0:
        return (0.0, 0.0)
    z = min(max(d[2], -1.0), 1.0)
    return (0.5 - math.atan2(d[1], d[0]) / (2.0 * math.pi), 1.0 - math.acos(z) / math.pi)


@device
def mirror_ball(d):
    """(u, v) where a ball seen along +y mirrors the unit direction."""
    y = d[1] - 1.0
    s = 2.0 * math.sqrt(max(-0.5 * y, 0.0))
    s = 1.0 / s if s > 0.0 else 1.0
    return (0.5 * (d[0] * s + 1.0), 0.5 * (d[2] * s + 1.0))


@entry
def environment_op(scene, _sp, registers, code, at):
    """Environment Texture: see opcodes.ENVIRONMENT."""
    scene = scene_at(scene, 0)
    out = load_i32(code, at)
    d = normalize(triple(registers, code, at + 1))
    uv = equirectangular(d) if load_i32(code, at + 4) == EQUIRECTANGULAR else mirror_ball(d)
    color = image_lookup(scene, load_i32(code, at + 2), uv[0], uv[1], load_i32(code, at + 3))
    store3_f64(registers, out, (color[0], color[1], color[2]))
    store_f64(registers, out + 3, color[3])
