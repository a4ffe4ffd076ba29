"""The second step of a frame: light samples and one direction by the BSDF, of which a pixel's reservoirs keep one each.

Resampled importance sampling (Talbot et al. 2005) of M light samples and one BSDF sample. Technique t, of which M_t
samples are drawn, is weighed by the balance heuristic, so that a sample of either has the resampling weight

    w = p̂ / (M p_light + p_bsdf)

with all three by solid angle: their ratio is the same by the coordinates that a reservoir keeps. (Light samples are
themselves resampled from tiles: their 1 / p_light is a contribution weight, and MIS goes by another density.) The
direction by the BSDF is that by which the path goes on afterwards, with what its ray has hit. It stands for the lights
that it finds whole; of others (hidden from some lobes, without shadows, without size) p_bsdf is 0 and only light
samples count.

Each light sample is a group with a shadow ray of its own; what the ray by the BSDF finds is another. A reservoir
resamples the groups by p̂ with V. Where no reuse follows, the vertex is lit by the sum of all groups instead. A p̂
without V asks for no V of what is not kept: then all are one group.
"""

import math

import numpy as np

from ....kernels.core import rng
from ....kernels.core.jit import device, inlined, kernel
from ....kernels.core.memory import record_at
from ....kernels.core.records import (
    INTEGRATOR,
    LIGHT_HITTABLE,
    LIGHT_SAMPLE_DELTA,
    LIGHT_SAMPLE_NO_SHADOW,
    MATERIAL_TRANSPARENT,
    POINT_ON_LAMP,
    POINT_ON_WORLD,
    RAY_LAST,
    RAY_TRANSPARENT,
    SCENE,
    SCENE_HAS_MEDIA,
    SCRATCH_LIGHT_SAMPLE,
    light_at,
    light_sample_at,
    material_at,
    path_at,
    shared_area,
    tile_point,
)
from ....kernels.core.vec import add, max3, mul, normalize, put, scale, store3_f32, vec
from ....kernels.core.warp import octahedral
from ....kernels.geometry.intersect import intersect
from ....kernels.geometry.surface import offset_origin, surface_point
from ....kernels.lights import (
    light_point,
    light_radiance,
    light_sample,
    lights_intersect,
    point_of_lamp,
    point_of_sample,
    sun_next,
    triangle_pdf,
)
from ....kernels.lights.mean_visibility import FIRST, learn, mean_visibility
from ....kernels.lights.world import world_pdf
from ....kernels.lobes import bsdf_has_eval, bsdf_sample
from ....kernels.lobes.classes import NO_LOBES, lobe_add, lobe_scale, lobe_sum, lobes_of, put_lobes
from ....kernels.lobes.closure import LABEL_SINGULAR, LABEL_SUBSURFACE, LABEL_TRANSPARENT
from ....kernels.path.direct import LOBE_RAYS, lit_bsdf
from ....kernels.path.state import DIM_DIRECTION, DIM_LOBE, FAR, next_after, ray_flags, ray_mask
from ....kernels.shading.interpreter import shader_eval
from ...resampling.candidates import point_at, reservoirs_of, store_light
from ...resampling.frame import FRAME, UNTRACED, hit_at
from ...resampling.options import TARGET, reuse_at
from ...resampling.reservoir import accept, clear, contribution_weight, reservoir_at
from .sample import DIRECT, direct_reservoir_at, keep
from .target import (
    brightness,
    control_variate_at,
    integrand,
    target_of_light,
    transmittance_to_light,
)

# What becomes of the reservoirs: nothing, or the next frame takes them up.
LAST, LAST_OF_FRAME = 1, 2

# Key of the candidates' random numbers, and their dimensions.
_CANDIDATES = 0x43414E44
_DIM_LIGHT, _DIM_POINT, _DIM_CHOICE, _DIM_GROUP = 0, 1, 2, 3

# What is streamed through the reservoir of each layer, in that part of working memory that scattering uses otherwise.
_POINT = [  # of a light: kernels.lights.points
    ("source", np.int64),
    ("primitive", np.int64),
    ("u", np.float64),
    ("v", np.float64),
]
STREAM = np.dtype(  # of a group's samples
    [
        ("total", np.float64),  # of the weights
        ("choice", np.float64),  # random number, what is left of it
        *_POINT,  # of the sample kept
        ("bsdf", np.float64, (9,)),  # towards it, by class of lobes
        ("bsdf_ratio", np.float64),  # p_bsdf / p_lights of a light sample, 0 where rays do not find it
        ("origin", np.float64),  # SAMPLED, FOUND or CLEAR
    ]
)
GROUPS = np.dtype(  # of what groups have kept
    [
        ("total", np.float64),
        ("choice", np.float64),
        *_POINT,
        ("f", np.float64, (9,)),  # as p̂ has it
        ("target", np.float64),
        ("visibility", np.float64, (3,)),
        ("light", np.float64, (9,)),  # Σ f V W of all groups
    ]
)
# A light sample; what the ray by the BSDF finds, behind something; and what it finds with nothing in its way.
SAMPLED, FOUND, CLEAR = 0.0, 1.0, 2.0
WORK_STREAMS = shared_area(3 * STREAM.itemsize + 3 * GROUPS.itemsize)
WORK_GROUPS = WORK_STREAMS + 3 * STREAM.itemsize
_stream_at = record_at(STREAM)
_groups_at = record_at(GROUPS)


@inlined
def _stream(scratch, layer):
    return _stream_at(scratch + WORK_STREAMS, layer)


@inlined
def _groups(scratch, layer):
    return _groups_at(scratch + WORK_GROUPS, layer)


@inlined
def _start(record, u):
    """Begin a STREAM or GROUPS that chooses by the random number u."""
    record.total = 0.0
    record.choice = u


@inlined
def _start_streams(scratch, layers, u):
    for layer in range(layers):
        _start(_stream(scratch, layer), u)


@inlined
def _start_groups(scratch, layers, u):
    for layer in range(layers):
        groups = _groups(scratch, layer)
        _start(groups, u)
        groups.target = 0.0
        put_lobes(groups.light, NO_LOBES)


@inlined
def _found_by_rays(scene, ls):
    """Whether the BSDF's directions find all that a light sends."""
    if ls.flags & (LIGHT_SAMPLE_DELTA | LIGHT_SAMPLE_NO_SHADOW) or ls.seen_by & LOBE_RAYS != LOBE_RAYS:
        return False
    return ls.light < 0 or light_at(scene.lights, ls.light).flags & LIGHT_HITTABLE != 0


@inlined
def _offer(reuse, layers, scratch, f, radiance, factor, ratio, origin):
    """Stream a sample by the weight p̂ · factor; bits of the layers that keep it. f: the BSDF."""
    rgb = mul(lobe_sum(f), radiance)
    keepers = 0
    for layer in range(layers):
        stream = _stream(scratch, layer)
        weight = brightness(reuse_at(reuse, layer), rgb) * factor
        if 0.0 < weight < math.inf:
            stream.total += weight
            chosen, u = accept(weight, float(stream.total), float(stream.choice))
            stream.choice = u
            if chosen:
                keepers |= 1 << layer
                stream.bsdf_ratio = ratio
                stream.origin = origin
                put_lobes(stream.bsdf, f)
    return keepers


@inlined
def _keep(scratch, layers, keepers, source, primitive, u, v):
    """Note which point of a light the layers `keepers` keep."""
    for layer in range(layers):
        if keepers >> layer & 1:
            stream = _stream(scratch, layer)
            stream.source = source
            stream.primitive = primitive
            stream.u = u
            stream.v = v


@inlined
def _light_candidate(scene, reuse, layers, scratch, sp, key, index, count):
    """Stream one of `count` light samples, that of an index of random numbers; its part of the mean of all variates."""
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    u0, u1 = rng.sample2(key, index, _DIM_POINT)
    if light_sample(scene, sp, scratch, u0, u1, rng.sample1(key, index, _DIM_LIGHT)):
        f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
        ratio = pdf / (count * ls.mis_pdf) if _found_by_rays(scene, ls) else 0.0
        factor = 1.0 / (ls.pdf * count * (1.0 + ratio))
        keepers = _offer(reuse, layers, scratch, f, vec(ls.radiance), factor, ratio, SAMPLED)
        if keepers:
            source, primitive, x, y = point_of_sample(scene, sp, ls)
            _keep(scratch, layers, keepers, source, primitive, x, y)
    return scale(vec(ls.control_variate), 1.0 / count)


@device
def _found(scene, reuse, layers, scratch, sp, count, origin, source, primitive, x, y, light_pdf):
    """Stream a light that the BSDF's ray found; count: of all light samples."""
    if not (light_pdf > 0.0 and light_point(scene, sp, scratch, source, primitive, x, y)):
        return
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    if not _found_by_rays(scene, ls):
        return
    f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
    factor = 1.0 / (count * light_pdf + pdf)
    keepers = _offer(reuse, layers, scratch, f, vec(ls.radiance), factor, 0.0, origin)
    _keep(scratch, layers, keepers, source, primitive, x, y)


@device
def _found_lamp(scene, reuse, layers, scratch, sp, count, origin, light, o, d, t):
    _, _, _, pdf = light_radiance(scene, scratch, sp, light, o, d, t)
    x, y = point_of_lamp(scene, light, o, d, t)
    _found(scene, reuse, layers, scratch, sp, count, origin, light, POINT_ON_LAMP, x, y, pdf)


@device
def _bsdf_candidate(scene, integrator, reuse, layers, scratch, path, sp, hit, count):
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
            _found(scene, reuse, layers, scratch, sp, count, origin, 0, POINT_ON_WORLD, x, y, world_pdf(scene, sp, d))
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


@inlined
def _copy_point(to, source):
    """Copy a point of a light from one record to another."""
    to.source = source.source
    to.primitive = source.primitive
    to.u = source.u
    to.v = source.v


@inlined
def _same(a, b):
    """Whether two streams have kept the same point."""
    return a.source == b.source and a.primitive == b.primitive and a.u == b.u and a.v == b.v


@device
def _close_group(scene, integrator, reuse, layers, frame, scratch, pixel, sp, last, at_hand):
    """Light the vertex by the samples that a group has kept, and stream them.

    at_hand: it is one light sample, the LIGHT_SAMPLE in scratch. Where nothing takes the samples up (last: LAST), V is
    that of whichever ray has found the light, as with PATH; reuse needs V to be one function, that of shadow rays.
    """
    f = NO_LOBES
    v = (0.0, 0.0, 0.0)
    known = -1  # the layer whose sample f and V are of
    for layer in range(layers):
        stream = _stream(scratch, layer)
        if stream.total <= 0.0:
            continue
        if known < 0 or not _same(stream, _stream(scratch, known)):
            f = NO_LOBES
            source, primitive = stream.source, stream.primitive
            if at_hand or light_point(scene, sp, scratch, source, primitive, float(stream.u), float(stream.v)):
                f = integrand(light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0), lobes_of(stream.bsdf))
                if last == LAST and stream.origin == CLEAR:
                    v = (1.0, 1.0, 1.0)
                else:
                    v = transmittance_to_light(scene, integrator, frame, scratch, pixel)
                if stream.origin == SAMPLED:
                    learn(path_at(frame.paths, pixel).mean_visibility, FIRST, v)
            known = layer
        _take(reuse_at(reuse, layer), _groups(scratch, layer), stream, f, v)


@inlined
def _take(options, groups, stream, f, v):
    """Add a group's sample to the light, and keep it by chance; one in shadow may be thrown away."""
    target = target_of_light(options, f)
    w = contribution_weight(float(stream.total), target)
    if w <= 0.0:
        return
    seen = lobe_scale(f, v)
    light = lobe_add(lobes_of(groups.light), lobe_scale(seen, (w, w, w)))
    put_lobes(groups.light, light)
    dark = target_of_light(options, seen) <= 0.0
    if dark and (options.visibility == TARGET or options.discard != 0):
        return
    if options.visibility == TARGET:
        f = seen
        target = target_of_light(options, f)
    elif max3(v) <= 0.0:
        # No ray by the BSDF can have found it: light samples alone stand for it (contribution MIS, eq. 7.1).
        w *= 1.0 + stream.bsdf_ratio
    groups.total += target * w
    chosen, u = accept(target * w, float(groups.total), float(groups.choice))
    groups.choice = u
    if chosen:
        _copy_point(groups, stream)
        groups.target = target
        put_lobes(groups.f, f)
        put(groups.visibility, v)


@inlined
def _settle(reuse, layers, frame, scratch, pixel, seed, last):
    """Fill the pixel's reservoirs and frame.light: p̂, V and W of what each layer has kept, or the light of all."""
    for layer in range(layers):
        options = reuse_at(reuse, layer)
        groups = _groups(scratch, layer)
        reservoirs = reservoirs_of(frame, options, frame.reservoirs)
        clear(reservoir_at(reservoirs, pixel), 1.0)
        r = direct_reservoir_at(reservoirs, pixel)
        r.seed = seed
        light = NO_LOBES
        if groups.target > 0.0:
            r.technique = DIRECT
            _copy_point(r, groups)
            r.target = groups.target
            r.contribution_weight = contribution_weight(float(groups.total), float(groups.target))
            keep(r, vec(groups.visibility))
            light = lobes_of(groups.f)
        if last != 0:
            light = lobe_add(lobes_of(groups.light), control_variate_at(frame, pixel))
        store_light(frame, options, pixel, light)


@inlined
def _draw(scene, integrator, reuse, layers, frame, scratch, pixel, path, sp, key, last):
    """Draw all candidates of a vertex, group by group; stores what the ray by the BSDF hits, and the variate."""
    options = reuse_at(reuse, 0)
    apart = last != 0 or options.visibility == TARGET
    count = options.light_samples
    variate = (0.0, 0.0, 0.0)
    expected = mean_visibility(path.mean_visibility, FIRST)
    choice = rng.sample1(key, path.sample, _DIM_CHOICE)
    _start_streams(scratch, layers, choice)
    for i in range(count):
        index = (path.sample * count + i) & 0xFFFFFFFF
        variate = add(variate, _light_candidate(scene, reuse, layers, scratch, sp, key, index, count))
        if apart:
            _close_group(scene, integrator, reuse, layers, frame, scratch, pixel, sp, last, True)
            _start_streams(scratch, layers, choice)
    store3_f32(frame.control_variates, pixel, scale(variate, expected))
    hit = hit_at(frame.hits, pixel)
    _bsdf_candidate(scene, integrator, reuse, layers, scratch, path, sp, hit, count)
    _close_group(scene, integrator, reuse, layers, frame, scratch, pixel, sp, last, False)


@kernel
def candidates_tile(scene: SCENE, integrator: INTEGRATOR, reuse, layers, frame: FRAME, scratch, x0, y0, x1, y1, last):
    """Fill the reservoirs of a tile. reuse: address of a REUSE for each of the layers of reservoirs.

    last: 0 where reuse follows; LAST, LAST_OF_FRAME: none does, so that frame.light is what lights.
    """
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = y * frame.width + x
            sp = point_at(frame, pixel)
            hit_at(frame.hits, pixel).instance = UNTRACED
            store3_f32(frame.control_variates, pixel, (0.0, 0.0, 0.0))
            path = path_at(frame.paths, pixel)
            key = rng.hash_combine(path.key, _CANDIDATES)
            _start_groups(scratch, layers, rng.sample1(key, path.sample, _DIM_GROUP))
            if sp.instance >= 0 and bsdf_has_eval(sp):
                _draw(scene, integrator, reuse, layers, frame, scratch, pixel, path, sp, key, last)
            _settle(reuse, layers, frame, scratch, pixel, rng.hash_combine(key, path.sample), last)
