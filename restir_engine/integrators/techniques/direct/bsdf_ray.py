"""The candidate by the BSDF: the direction by which the path goes on, and the lights that its ray finds."""

from ....kernels.core import rng
from ....kernels.core.jit import device
from ....kernels.core.records import (
    MATERIAL_TRANSPARENT,
    POINT_ON_LAMP,
    POINT_ON_WORLD,
    RAY_LAST,
    RAY_TRANSPARENT,
    SCENE_HAS_MEDIA,
    SCRATCH_LIGHT_SAMPLE,
    light_sample_at,
    material_at,
    tile_point,
)
from ....kernels.core.vec import max3, normalize, vec
from ....kernels.core.warp import octahedral
from ....kernels.geometry.intersect import intersect
from ....kernels.geometry.surface import offset_origin, surface_point
from ....kernels.lights import (
    light_point,
    light_radiance,
    lights_intersect,
    point_of_lamp,
    sun_next,
    triangle_pdf,
    world_pdf,
)
from ....kernels.lobes import bsdf_sample
from ....kernels.lobes.closure import LABEL_SINGULAR, LABEL_SUBSURFACE, LABEL_TRANSPARENT
from ....kernels.path.direct import lit_bsdf
from ....kernels.path.state import DIM_DIRECTION, DIM_LOBE, FAR, next_after, ray_flags, ray_mask
from ....kernels.shading.interpreter import shader_eval
from .streams import CLEAR, FOUND, found_by_rays, keep_point, offer


@device
def _found(scene, reuse, layers, scratch, sp, count, origin, source, primitive, x, y, light_pdf):
    """Stream a light that the BSDF's ray found; count: of all light samples."""
    if not (light_pdf > 0.0 and light_point(scene, sp, scratch, source, primitive, x, y)):
        return
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    if not found_by_rays(scene, ls):
        return
    f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
    factor = 1.0 / (count * light_pdf + pdf)
    keepers = offer(reuse, layers, scratch, f, vec(ls.radiance), factor, 0.0, origin)
    keep_point(scratch, layers, keepers, source, primitive, x, y)


@device
def _found_lamp(scene, reuse, layers, scratch, sp, count, origin, light, o, d, t):
    _, _, _, pdf = light_radiance(scene, scratch, sp, light, o, d, t)
    x, y = point_of_lamp(scene, light, o, d, t)
    _found(scene, reuse, layers, scratch, sp, count, origin, light, POINT_ON_LAMP, x, y, pdf)


@device
def bsdf_candidate(scene, integrator, reuse, layers, scratch, path, sp, hit, count):
    """Stream what the path's next ray finds; keep what it hits first."""
    u0 = rng.sample1(path.key, path.sample, path.dimension + DIM_LOBE)
    u1, u2 = rng.sample2(path.key, path.sample, path.dimension + DIM_DIRECTION)
    label, wi, _, pdf = bsdf_sample(scene, sp, u0, u1, u2)
    if label == 0 or label & (LABEL_SINGULAR | LABEL_TRANSPARENT | LABEL_SUBSURFACE) or pdf <= 0.0:
        return
    o = offset_origin(sp, wi)
    d = normalize(wi)
    flags = ray_flags(label)
    point = tile_point(scratch)
    tmin = 0.0
    origin = FOUND if scene.flags & SCENE_HAS_MEDIA else CLEAR
    for _ in range(integrator.transparent_bounces - path.transparent_bounce + 1):
        t, instance, primitive, x, y = intersect(scene, scratch, o, d, tmin, FAR, ray_mask(flags))
        if tmin == 0.0:
            hit.instance = instance
            hit.primitive = primitive
            hit.t = t
            hit.u = x
            hit.v = y
        for _ in range(scene.n_lights):
            light, distance = lights_intersect(scene, o, d, tmin, t, flags)
            if light < 0:
                break
            _found_lamp(scene, reuse, layers, scratch, sp, count, origin, light, o, d, distance)
            tmin = next_after(distance)
        if instance < 0:
            light = sun_next(scene, d, 0, flags)
            while light >= 0:
                _found_lamp(scene, reuse, layers, scratch, sp, count, origin, light, o, d, FAR)
                light = sun_next(scene, d, light + 1, flags)
            x, y = octahedral(d)
            density = world_pdf(scene, scratch, sp, vec(sp.p), d)
            _found(scene, reuse, layers, scratch, sp, count, origin, 0, POINT_ON_WORLD, x, y, density)
            return
        surface_point(scene, point, instance, primitive, x, y, t, d)
        density = triangle_pdf(scene, point, vec(sp.p))
        _found(scene, reuse, layers, scratch, sp, count, origin, instance, primitive, x, y, density)
        if material_at(scene.materials, point.material).flags & MATERIAL_TRANSPARENT == 0:
            return
        flags |= RAY_TRANSPARENT
        point.ray_flags = flags | RAY_LAST
        shader_eval(scene, point)
        if max3(vec(point.transparent)) <= 0.0:
            return
        tmin = next_after(t)
        origin = FOUND
