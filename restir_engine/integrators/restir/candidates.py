"""The second step of a frame: light samples and one direction by the BSDF, of which a pixel's reservoir keeps one.

Resampled importance sampling (Talbot et al. 2005) of M light samples and one BSDF sample. Technique t, of which M_t
samples are drawn, is weighed by the balance heuristic, so that a sample of either has the resampling weight

    w = p̂ / (M p_light + p_bsdf)

with all three by solid angle: their ratio is the same by the coordinates that a reservoir keeps. (A light sample from
tiles is itself resampled: its 1 / p_light is a contribution weight, and MIS goes by another density.) The direction by
the BSDF is that by which the path goes on afterwards. It stands for the lights that it finds whole; of others (hidden
from some lobes, without shadows, without size) p_bsdf is 0 and only light samples count.
"""

import math

from ...kernels import rng
from ...kernels.direct import LOBE_RAYS, lit_bsdf, lobe_sum
from ...kernels.interaction import offset_origin, surface_point
from ...kernels.intersect import intersect
from ...kernels.jit import device, inlined, kernel
from ...kernels.lights import (
    light_point,
    light_radiance,
    light_sample,
    lights_intersect,
    point_of_lamp,
    point_of_sample,
    sun_next,
    triangle_pdf,
)
from ...kernels.lobes import (
    LABEL_SINGULAR,
    LABEL_SUBSURFACE,
    LABEL_TRANSPARENT,
    bsdf_has_eval,
    bsdf_sample,
)
from ...kernels.path_state import DIM_DIRECTION, DIM_LOBE, FAR, next_after, ray_flags
from ...kernels.path_state import visibility as ray_visibility
from ...kernels.records import (
    LIGHT_HITTABLE,
    LIGHT_SAMPLE_DELTA,
    LIGHT_SAMPLE_NO_SHADOW,
    MATERIAL_TRANSPARENT,
    POINT_ON_LAMP,
    POINT_ON_WORLD,
    RAY_LAST,
    RAY_TRANSPARENT,
    SCRATCH_LIGHT_SAMPLE,
    instance_at,
    light_at,
    light_sample_at,
    material_at,
    path_at,
)
from ...kernels.shader_vm import shader_eval
from ...kernels.vec import max3, mul, normalize, vec
from ...kernels.warp import octahedral
from ...kernels.world import world_pdf
from ..path import tile_point
from .options import TARGET
from .reservoir import accept, clear, contribution_weight, reservoir_at
from .reuse import reservoirs_of
from .target import brightness, masked, point_at, target_of_light, unshadowed, visibility
from .visibility import keep

# Key of the candidates' random numbers, and their dimensions.
_CANDIDATES = 0x43414E44
_DIM_LIGHT, _DIM_POINT, _DIM_CHOICE = 0, 1, 2


@inlined
def light_target(scene, reuse, sp, ls):
    """(p̂ by solid angle without visibility, the BSDF's density) of a LIGHT_SAMPLE at sp."""
    f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.visibility)
    return brightness(reuse, mul(lobe_sum(f), vec(ls.radiance))), pdf


@inlined
def _found_by_rays(scene, ls):
    """Whether the BSDF's directions find all that a light sends."""
    if ls.flags & (LIGHT_SAMPLE_DELTA | LIGHT_SAMPLE_NO_SHADOW) or ls.visibility & LOBE_RAYS != LOBE_RAYS:
        return False
    return ls.light < 0 or light_at(scene.lights, ls.light).flags & LIGHT_HITTABLE != 0


@inlined
def _keep(r, source, primitive, u, v, ratio):
    """ratio: the density of the BSDF's direction by that of the light samples; 0 for what a ray has found."""
    r.bsdf_ratio = ratio
    r.source = source
    r.primitive = primitive
    r.u = u
    r.v = v


@inlined
def _light_candidates(scene, reuse, scratch, path, sp, r, u):
    """Stream light samples through a reservoir: (sum of weights, what is left of the random number u)."""
    count = reuse.candidates
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    key = rng.hash_combine(path.key, _CANDIDATES)
    total = 0.0
    for i in range(count):
        index = (path.sample * count + i) & 0xFFFFFFFF
        u0, u1 = rng.sample2(key, index, _DIM_POINT)
        if not light_sample(scene, sp, scratch, u0, u1, rng.sample1(key, index, _DIM_LIGHT)):
            continue
        target, pdf = light_target(scene, reuse, sp, ls)
        ratio = pdf / (count * ls.mis_pdf) if _found_by_rays(scene, ls) else 0.0
        weight = target / (ls.pdf * count * (1.0 + ratio))
        if 0.0 < weight < math.inf:
            total += weight
            chosen, u = accept(weight, total, u)
            if chosen:
                source, primitive, x, y = point_of_sample(scene, sp, ls)
                _keep(r, source, primitive, x, y, ratio)
    return total, u


@device
def _found(scene, reuse, scratch, sp, r, total, u, source, primitive, x, y, light_pdf):
    """Stream a light that the BSDF's ray found: (sum of weights, u)."""
    if not (light_pdf > 0.0 and light_point(scene, sp, scratch, source, primitive, x, y)):
        return total, u
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    if not _found_by_rays(scene, ls):
        return total, u
    target, pdf = light_target(scene, reuse, sp, ls)
    weight = target / (reuse.candidates * light_pdf + pdf)
    if not 0.0 < weight < math.inf:
        return total, u
    total += weight
    chosen, u = accept(weight, total, u)
    if chosen:
        _keep(r, source, primitive, x, y, 0.0)
    return total, u


@device
def _found_lamp(scene, reuse, scratch, sp, r, total, u, light, o, d, t):
    _, _, _, pdf = light_radiance(scene, scratch, sp, light, o, d, t)
    x, y = point_of_lamp(scene, light, o, d, t)
    return _found(scene, reuse, scratch, sp, r, total, u, light, POINT_ON_LAMP, x, y, pdf)


@device
def _bsdf_candidate(scene, integrator, reuse, scratch, path, sp, r, total, u):
    """Stream what the path's next ray finds: (sum of weights, u)."""
    u0 = rng.sample1(path.key, path.sample, path.dimension + DIM_LOBE)
    u1, u2 = rng.sample2(path.key, path.sample, path.dimension + DIM_DIRECTION)
    label, wi, _, pdf = bsdf_sample(scene, sp, u0, u1, u2)
    if label == 0 or label & (LABEL_SINGULAR | LABEL_TRANSPARENT | LABEL_SUBSURFACE) or pdf <= 0.0:
        return total, u
    o = offset_origin(sp, wi)
    d = normalize(wi)
    flags = ray_flags(label)
    point = tile_point(scratch)
    tmin = 0.0
    for _ in range(integrator.transparent_bounces - path.transparent_bounce + 1):
        t, instance, primitive, x, y = intersect(scene, scratch, o, d, tmin, FAR, ray_visibility(flags))
        for _ in range(scene.n_lights):
            light, distance = lights_intersect(scene, o, d, tmin, t, flags)
            if light < 0:
                break
            total, u = _found_lamp(scene, reuse, scratch, sp, r, total, u, light, o, d, distance)
            tmin = next_after(distance)
        if instance < 0:
            light = sun_next(scene, d, 0, flags)
            while light >= 0:
                total, u = _found_lamp(scene, reuse, scratch, sp, r, total, u, light, o, d, FAR)
                light = sun_next(scene, d, light + 1, flags)
            x, y = octahedral(d)
            density = world_pdf(scene, d)
            return _found(scene, reuse, scratch, sp, r, total, u, 0, POINT_ON_WORLD, x, y, density)
        surface_point(scene, point, instance, primitive, x, y, t, d)
        if instance_at(scene.instances, instance).lights >= 0:
            density = triangle_pdf(scene, point, vec(sp.p))
            total, u = _found(scene, reuse, scratch, sp, r, total, u, instance, primitive, x, y, density)
        if material_at(scene.materials, point.material).flags & MATERIAL_TRANSPARENT == 0:
            return total, u
        flags |= RAY_TRANSPARENT
        point.ray_flags = flags | RAY_LAST
        shader_eval(scene, point)
        if max3(vec(point.transparent)) <= 0.0:
            return total, u
        tmin = next_after(t)
    return total, u


@inlined
def _settle(scene, integrator, reuse, frame, scratch, pixel, sp, r, total):
    """Give the chosen sample its p̂, V and W; one that is found in shadow becomes a null sample where that is wanted."""
    if total <= 0.0:
        return
    f = unshadowed(scene, sp, scratch, int(r.source), int(r.primitive), float(r.u), float(r.v))
    r.target = target_of_light(reuse, f)
    w = contribution_weight(total, float(r.target))
    if r.target > 0.0:
        v = visibility(scene, integrator, frame, scratch, pixel)
        keep(r, v)
        seen = target_of_light(reuse, masked(f, v))
        if reuse.visibility == TARGET:
            r.target = seen
        elif max3(v) <= 0.0:
            # No ray by the BSDF can have found it: light samples alone stand for it (contribution MIS, eq. 7.1).
            w *= 1.0 + r.bsdf_ratio
        if seen <= 0.0 and (reuse.visibility == TARGET or reuse.discard != 0):
            w = 0.0
    r.contribution_weight = w


@kernel
def candidates_tile(scene, integrator, reuse, frame, scratch, x0, y0, x1, y1):
    """Fill the reservoirs of a tile."""
    start = reservoirs_of(frame, reuse, frame.reservoirs)
    for y in range(y0, y1):
        for x in range(x0, x1):
            index = y * frame.width + x
            r = reservoir_at(start, index)
            clear(r, 1.0)
            sp = point_at(frame, index)
            if sp.instance < 0 or not bsdf_has_eval(sp):
                continue
            path = path_at(frame.paths, index)
            key = rng.hash_combine(path.key, _CANDIDATES)
            u = rng.sample1(key, path.sample, _DIM_CHOICE)
            r.seed = rng.hash_combine(key, path.sample)
            total, u = _light_candidates(scene, reuse, scratch, path, sp, r, u)
            total, _ = _bsdf_candidate(scene, integrator, reuse, scratch, path, sp, r, total, u)
            _settle(scene, integrator, reuse, frame, scratch, index, sp, r, total)
