"""The integrand S(x₁, x₂) E(x₂, x₃) of a path below the surface, and its target p̂, at any x₁.

E, what x₃ brings to x₂, does not depend on x₁: a sample carries it, V included, and as long as x₂ and x₃ stay neither
a ray nor a light is asked again.
"""

import math

from ....kernels.core.jit import device, entry, inlined
from ....kernels.core.memory import copy_words, record_address
from ....kernels.core.records import (
    PATH,
    SCENE_HAS_MEDIA,
    SCRATCH_CLOSURES,
    SCRATCH_PATH,
    SHADING_POINT,
    integrator_at,
    light_sample_in,
    path_at,
    tile_point,
)
from ....kernels.core.vec import is_black, length, mul, put, scale, sub, vec
from ....kernels.geometry.surface import triangle_place
from ....kernels.lights import light_point
from ....kernels.lobes.classes import Lobes, lobe_sum
from ....kernels.path.direct import lit_bsdf
from ....kernels.path.shadow import light_visibility
from ....kernels.subsurface.bssrdf import bssrdf_at, diffused
from ....kernels.subsurface.exit import leave
from ....kernels.volume.calls import media_around
from ...resampling.frame import frame_at
from ...resampling.inputs import point_at, scene_of
from ...resampling.options import reuse_at
from ...resampling.technique import domain_at, shifted_at, store_f
from .sample import NEEDS_LIGHT, TURNED, point_of, sample_at

POINT_WORDS, PATH_WORDS = SHADING_POINT.itemsize // 8, PATH.itemsize // 8
_BLACK = (0.0, 0.0, 0.0)


@inlined
def diffuse_lobes(rgb):
    """Light from below a surface, by class of lobes."""
    return Lobes(rgb, _BLACK, _BLACK)


@inlined
def brightness(reuse, rgb):
    """p̂ of a contribution."""
    return reuse.weights[0] * abs(rgb[0]) + reuse.weights[1] * abs(rgb[1]) + reuse.weights[2] * abs(rgb[2])


@inlined
def place_of(scene, r):
    """(x₂, its outward normal) of a reservoir's sample in a scene."""
    p, n, _ = triangle_place(scene, int(r.instance), int(r.primitive), float(r.u), float(r.v))
    return p, scale(n, -1.0 if r.flags & TURNED else 1.0)


@device
def copy_point(frame, scratch, pixel):
    """Copy a pixel's x₁ to the tile's SHADING_POINT, without its closures; returns that."""
    sp = tile_point(scratch)
    registers = sp.registers
    copy_words(record_address(sp), record_address(point_at(frame, pixel)), POINT_WORDS)
    sp.closures = scratch + SCRATCH_CLOSURES
    sp.registers = registers
    return sp


@inlined
def irradiance(scene, scratch, source, primitive, u, v):
    """rgb: what a light's point brings to the exit at the tile's SHADING_POINT, without V.

    By the measure of the light's points. Leaves the LIGHT_SAMPLE in scratch.
    """
    sp = tile_point(scratch)
    if not light_point(scene, sp, scratch, source, primitive, u, v):
        return _BLACK
    return irradiance_by(scene, sp, light_sample_in(scratch))


@inlined
def irradiance_by(scene, sp, ls):
    """The same of a LIGHT_SAMPLE from light_point or a tile."""
    f, _ = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
    rgb = scale(mul(lobe_sum(f), vec(ls.radiance)), 1.0 / ls.point_pdf)
    return rgb if math.isfinite(rgb[0] + rgb[1] + rgb[2]) else _BLACK


@device
def visibility(scene, integrator, frame, scratch, pixel):
    """V by channel between the exit at the tile's SHADING_POINT and the LIGHT_SAMPLE in scratch; path of the pixel."""
    path = path_at(frame.paths, pixel)
    if scene.flags & SCENE_HAS_MEDIA:  # whose code takes the path from working memory
        copy_words(scratch + SCRATCH_PATH, record_address(path), PATH_WORDS)
    media_around(scene, integrator, scratch, path, point_at(frame, pixel))
    return light_visibility(scene, integrator, scratch, path, tile_point(scratch))


@device
def light_sample_again(domain, r, x, n):
    """Set E of a reservoir's sample in a domain, by a shadow ray; (x, n): x₂ and its outward normal."""
    d = domain_at(domain, 0)
    scene, integrator, frame = scene_of(d), integrator_at(d.integrator, 0), frame_at(d.frame, 0)
    sp = copy_point(frame, d.scratch, d.pixel)
    sp.instance = int(r.instance)
    distance = length(sub(x, vec(sp.p)))
    leave(scene, sp, int(r.primitive), float(r.u), float(r.v), distance, n)
    primitive, u, v = int(r.light_primitive), float(r.light_u), float(r.light_v)
    e = irradiance(scene, d.scratch, int(r.source), primitive, u, v)
    if not is_black(e):
        e = mul(e, visibility(scene, integrator, frame, d.scratch, d.pixel))
    put(r.irradiance, e)
    r.flags &= ~NEEDS_LIGHT


@entry
def target_subsurface(domain, shifted, a, b, c):
    """f and p̂ of a shifted sample (see resampling.technique)."""
    d = domain_at(domain, 0)
    bssrdf = bssrdf_at(point_of(frame_at(d.frame, 0), d.pixel), 0)
    r = sample_at(shifted, 0)
    x, n = place_of(scene_of(d), r)
    s = diffused(bssrdf, sub(x, vec(bssrdf.p)), n)
    if is_black(s):
        return
    if r.flags & NEEDS_LIGHT:
        light_sample_again(domain, r, x, n)
    f = mul(s, vec(r.irradiance))
    shifted_at(shifted, 0).target = brightness(reuse_at(d.reuse, 0), f)
    store_f(shifted, diffuse_lobes(f))
