"""The hybrid shift: random replay up to the vertex before k, then a connection to what the sample has kept as vertex k.

In primary sample space (course, eq. 6.15 to 6.18; θ_k is at the arrival vertex x_k),

    |T'| = [p_{k-1}(ω', ℓ) · cos θ_k / |x_k - y_{k-1}|² · p_k(ω_k, ℓ_k)] / [the same of the path as it was]

where p(ω, ℓ) is the density with which the BSDF's sampling returns ω with the label ℓ. The last factor is missing where
a light sample lights vertex k; what is replayed, and points of lights by their own measure, have Jacobian 1.
"""

from ....kernels.core.jit import device, entry, inlined
from ....kernels.core.records import (
    RAY_DIFFUSE,
    SCRATCH_LIGHT_SAMPLE,
    camera_at,
    film_at,
    integrator_at,
    light_sample_at,
    path_in,
    scene_at,
    shadow_point_in,
    tile_point,
)
from ....kernels.core.vec import dot, is_black, length, mul, put, scale, sub, vec
from ....kernels.film.contribute import class_shares
from ....kernels.geometry.leaving import occluded_from
from ....kernels.geometry.surface import offset_origin, surface_point, triangle_point
from ....kernels.lights import drawn_pdf, light_point, samples_tiles
from ....kernels.lobes import bsdf_eval, label_pdf
from ....kernels.lobes.classes import NO_LOBES, lobe_scale, lobe_sum
from ....kernels.lobes.closure import LABEL_REFLECT
from ....kernels.path.direct import LOBE_RAYS, lit_bsdf
from ....kernels.path.shadow import light_visibility
from ....kernels.path.state import inherit, mis_weight, next_ray, next_state, ray_mask
from ...path.surface import shade
from ...resampling.frame import frame_at
from ...resampling.motion import look_up, motion_at
from ...resampling.options import reuse_at
from ...resampling.reservoir import INDIRECT
from ...resampling.technique import NOW, domain_at, load_f, shifted_at, store_f, technique_at
from ..direct.shift import source_before, source_now
from ..direct.target import target_of_light
from .collect import by_class, clamped
from .pixel import same_state
from .replay import replay, replay_ray, start_replay
from .sample import (
    AT_LIGHT,
    BACKFACING,
    REPLAYED,
    WENT_ON,
    kind_of,
    label_at,
    label_before,
    path_reservoir_at,
    unpack_direction,
    vertex_of,
)
from .walk import connects, geometry, replayed_tags, walk_of
from .work import SHIFTS, count


@entry
def shift_path(start, to, reservoir, shifted, unused):
    """T(x) and |T'| of a path from one pixel, of either frame, to another, and F there (resampling.technique)."""
    a, b = domain_at(start, 0), domain_at(to, 0)
    r = path_reservoir_at(shifted, 0)
    frame = frame_at(b.frame, 0)
    if not same_state(frame_at(a.frame, 0), a.pixel, frame, b.pixel):
        return
    if a.when != b.when and not _carry(a, b, r):
        return
    scene, scratch, options = scene_at(b.scene, 0), b.scratch, reuse_at(b.reuse, 0)
    integrator = integrator_at(b.integrator, 0)
    row = technique_at(options.technique, 0)
    walk, path, sp = walk_of(scratch), path_in(scratch), tile_point(scratch)
    walk.code = row.taker
    key = r.seed & 0xFFFFFFFF
    integrator = start_replay(scene, integrator, frame, scratch, walk, options, path, sp, b.pixel, key, int(r.index))
    count(scratch, SHIFTS, 1)
    prefix = vec(walk.prefix)
    camera, film = camera_at(scene.camera, 0), film_at(row.film, 0)
    if not replay(scene, camera, integrator, film, scratch, walk, path, sp, vertex_of(r.flags) - 2):
        return
    kind = kind_of(r.flags)
    f = NO_LOBES
    jacobian = 1.0
    if kind == REPLAYED:
        if not replay_ray(scene, camera, integrator, film, scratch, walk, path, sp, int(r.instance)):
            return
        if r.tags != replayed_tags(walk):
            return
        f = by_class(path, vec(walk.found))
        r.light_group = walk.found_group
    else:
        if r.tags != (replayed_tags(walk) if walk.vertex > 1 else 0):
            return
        if kind == AT_LIGHT:
            f = _light_there(scene, integrator, scratch, walk, path, sp, r)
        else:
            f, jacobian = _connect(scene, integrator, scratch, walk, path, sp, r, kind)
    if is_black(lobe_sum(f)) or jacobian <= 0.0:
        return
    store_f(shifted, clamped(integrator, prefix, f, r.flags & INDIRECT))
    shifted_at(shifted, 0).jacobian = jacobian / r.jacobian
    r.jacobian = jacobian


@entry
def target_path(domain, shifted, a, b, c):
    """p̂ of a shifted path (see resampling.technique), whose F the shift has found."""
    shifted_at(shifted, 0).target = target_of_light(reuse_at(domain_at(domain, 0).reuse, 0), load_f(shifted))


@inlined
def _carry(a, b, r):
    """Find what a sample has kept again in the other frame; False where it is not there."""
    motion = motion_at(a.motion, 0)
    there, primitive = int(r.instance), int(r.primitive)
    to_now = b.when == NOW
    kind = kind_of(r.flags)
    if kind == REPLAYED:  # a lamp, or whatever surface
        if there >= 0:
            there = look_up(motion.lamp_after if to_now else motion.lamp_before, there)
            if there < 0:
                return False
    else:
        if kind != AT_LIGHT:
            there = look_up(motion.instance_after if to_now else motion.instance_before, there)
        elif to_now:
            there = source_now(motion, there, primitive)
        else:
            there = source_before(motion, there, primitive)
        if there < 0:
            return False
    r.instance = there
    return True


@device
def _light_there(scene, integrator, scratch, walk, path, sp, r):
    """F of a light sample at the vertex that the replay has come to."""
    if not light_point(scene, sp, scratch, int(r.instance), int(r.primitive), float(r.u), float(r.v)):
        return NO_LOBES
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
    total = lobe_sum(f)
    if is_black(total) or (ls.seen_by & LOBE_RAYS == LOBE_RAYS and connects(walk, sp, pdf)):
        return NO_LOBES
    m = 1.0
    if r.density >= 0.0:
        drawn = r.density * ls.point_pdf if samples_tiles(scene) else drawn_pdf(scene, scratch, sp)
        m = mis_weight(drawn, pdf)
    v = light_visibility(scene, integrator, scratch, path, sp)
    light = scale(mul(mul(vec(ls.radiance), v), vec(path.throughput)), m / ls.point_pdf)
    f = lobe_scale(f, light)
    return f if path.bounce == 0 else by_class(path, lobe_sum(f))


@device
def _connect(scene, integrator, scratch, walk, path, sp, r, kind):
    """(F, the densities of the reconnection multiplied) from the vertex that the replay has come to; 0: it fails."""
    instance, primitive, u, v = int(r.instance), int(r.primitive), float(r.u), float(r.v)
    there = triangle_point(scene, instance, primitive, u, v)
    between = sub(there, vec(sp.p))
    distance = length(between)
    if not distance > 0.0:
        return NO_LOBES, 0.0
    wi = scale(between, 1.0 / distance)
    label = label_before(r.flags)
    f, pdf = bsdf_eval(scene, sp, wi)
    total = lobe_sum(f)
    if pdf <= 0.0 or is_black(total) or connects(walk, sp, pdf):
        return NO_LOBES, 0.0
    arrives = label_pdf(sp, wi, label) if sp.n_closures > 1 else pdf
    if arrives <= 0.0 or (dot(vec(sp.ng), wi) > 0.0) != (label & LABEL_REFLECT != 0):
        return NO_LOBES, 0.0
    if path.bounce == 0:
        diffuse, glossy = class_shares(f)
        put(path.diffuse_share, diffuse)
        put(path.glossy_share, glossy)
    throughput = scale(mul(vec(path.throughput), total), 1.0 / pdf)
    o = offset_origin(sp, wi)
    to_there = sub(there, o)
    reach = length(to_there)
    d = scale(to_there, 1.0 / reach)
    # The walk as it stands at vertex k.
    put(walk.before, vec(sp.p))
    walk.before_cosine = abs(dot(vec(sp.ng), wi))
    walk.pdf = pdf
    walk.vertex += 1
    next_ray(path, sp, o, d)
    next_state(path, integrator, label, pdf)
    point = shadow_point_in(scratch)
    inherit(point, path, distance)
    if path.flags & RAY_DIFFUSE:
        point.ray_flags |= integrator.after_diffuse
    surface_point(scene, point, instance, primitive, u, v, distance, d)
    if point.backfacing != (1 if r.flags & BACKFACING else 0):
        return NO_LOBES, 0.0
    shade(scene, integrator, path, point)
    direction = unpack_direction(int(r.direction))
    g, pdf = bsdf_eval(scene, point, direction)
    total = lobe_sum(g)
    if is_black(total) or not connects(walk, point, pdf):
        return NO_LOBES, 0.0
    leaves = 1.0
    weight = 1.0
    if kind == WENT_ON:
        label = label_at(r.flags)
        leaves = label_pdf(point, direction, label) if point.n_closures > 1 else pdf
        if leaves <= 0.0 or (dot(vec(point.ng), direction) > 0.0) != (label & LABEL_REFLECT != 0):
            return NO_LOBES, 0.0
        weight = 1.0 / pdf
        if r.density > 0.0:
            weight *= mis_weight(pdf, r.density)
    elif r.density > 0.0:
        weight = mis_weight(r.density, pdf)
    if occluded_from(scene, scratch, sp, o, d, reach * (1.0 - 2.0e-5), ray_mask(path.flags)):
        return NO_LOBES, 0.0
    value = mul(mul(throughput, total), scale(vec(r.radiance), weight))
    return by_class(path, value), arrives * leaves * geometry(point, vec(sp.p))
