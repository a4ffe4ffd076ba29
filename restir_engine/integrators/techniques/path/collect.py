"""What a path finds, as samples: one of them is kept by resampling, in proportion to its p̂.

A sample is the light of one technique at one length: a light sample at vertex n, or what the ray from there finds. So
samples share no light and need no MIS weights among themselves; MIS between the two techniques is in their integrand F.
F is what the path tracer adds, BSDF / density of all bounces and all, so that its contribution weight in primary sample
space is 1 (course, ch. 6), but for what F leaves out: Russian roulette (1 / Π q), and the density of a light sample
whose point is kept, or whose W is an estimate as it has been resampled from a tile (ReSTIR PT Enhanced, supplement 5).
"""

from ....kernels.core.jit import inlined, outcome_entry
from ....kernels.core.records import LIGHT_SAMPLE_DELTA, integrator_at, light_sample_in, path_at
from ....kernels.core.vec import LARGEST_RADIANCE, add, max3, mul, put, scale, sub, vec
from ....kernels.film.contribute import sample_group
from ....kernels.lights import point_of_sample, point_pdf_of, samples_tiles
from ....kernels.lobes import label_pdf
from ....kernels.lobes.classes import Lobes, lobe_scale, lobe_sum, put_lobes
from ....kernels.path.direct import LOBE_RAYS
from ....kernels.path.state import hit_weight, mis_weight
from ...resampling.options import INDIRECT_PATHS, reuse_at
from ...resampling.reservoir import INDIRECT, accept, copy_reservoir
from ..direct.target import target_of_light
from .sample import (
    AT_LIGHT,
    LIT_THERE,
    PATH,
    REPLAYED,
    WENT_ON,
    label_of_tag,
    pack_direction,
    pack_flags,
    path_reservoir_at,
    tag_of,
)
from .walk import bounce_pdf, connection_of, connects, geometry, kept_of, replayed_tags, tags_before, walk_at


@inlined
def by_class(path, value):
    """A value by the classes of lobes at the path's first bounce."""
    d, g = mul(value, vec(path.diffuse_share)), mul(value, vec(path.glossy_share))
    return Lobes(d, g, sub(value, (d[0] + g[0], d[1] + g[1], d[2] + g[2])))


@inlined
def clamped(integrator, prefix, f, indirect):
    """F with clamps: prefix F is what the film would get. What is not finite is black."""
    rgb = mul(prefix, lobe_sum(f))
    total = abs(rgb[0]) + abs(rgb[1]) + abs(rgb[2])
    limit = integrator.clamp_indirect if indirect else integrator.clamp_direct
    s = 1.0
    if not total <= LARGEST_RADIANCE:
        s = 0.0
    elif total > limit:
        s = limit / total
    return lobe_scale(f, (s, s, s))


@inlined
def put_connection(walk, path, sp, kind, pdf):
    """Make the vertex sp the one that is reconnected to: the fields of `connection` but for light, and the Jacobian."""
    r = path_reservoir_at(connection_of(walk), 0)
    r.technique = PATH
    r.tags = tags_before(walk)
    r.instance = sp.instance
    r.primitive = sp.primitive
    r.u = sp.u
    r.v = sp.v
    at = tag_of(path.flags) & 3 if kind == WENT_ON else 0
    r.flags = pack_flags(walk.vertex, walk.tag & 3, at, kind, sp.backfacing)
    r.jacobian = walk.label_pdf * geometry(sp, vec(walk.before)) * pdf


@inlined
def offer(walk, path, f, indirect, w):
    """Stream the sample in walk.connection, of integrand f and contribution weight w."""
    f = clamped(integrator_at(walk.integrator, 0), vec(walk.prefix), f, indirect)
    target = target_of_light(reuse_at(walk.reuse, 0), f)
    if not target * w > 0.0:
        return
    walk.total += target * w
    chosen, u = accept(target * w, float(walk.total), float(walk.choice))
    walk.choice = u
    if chosen:
        walk.target = target
        put_lobes(walk.f, f)
        copy_reservoir(kept_of(walk), connection_of(walk))
        r = path_reservoir_at(kept_of(walk), 0)
        r.flags = (r.flags | INDIRECT) if indirect else (r.flags & ~INDIRECT)


@inlined
def put_found(r, radiance, density):
    """What comes from behind the vertex of a connection."""
    put(r.radiance, radiance)
    r.density = density


@inlined
def _beyond(walk, value):
    """A value by the path's throughput as what comes to vertex k from behind, without roulette."""
    return scale(value, walk.survival / (walk.survival_before * walk.behind))


@outcome_entry
def take_found(address, path, kind, source, group):
    """The TAKER of whole paths, made and replayed (see kernels.film.contribute)."""
    walk, path = walk_at(address), path_at(path, 0)
    value = vec(walk.value)
    if walk.reuse == 0:
        if source == walk.source and path.bounce > walk.bounces:
            put(walk.found, add(vec(walk.found), value))
            walk.found_group = group
        return 1
    nearest = 1 if reuse_at(walk.reuse, 0).paths == INDIRECT_PATHS else 0
    if path.bounce <= walk.bounces + nearest:
        # Light that no bounce has to do with, and that of direct light's own estimate.
        put(walk.value, mul(value, vec(walk.prefix)))
        return 0
    r = path_reservoir_at(connection_of(walk), 0)
    r.light_group = group
    if walk.k > 0:
        value = _beyond(walk, value)
        f = mul(vec(walk.throughput), value)
        density, weight = 0.0, 1.0
        if path.bounce == walk.bounces_there:
            density = walk.light_pdf
            weight = hit_weight(path, density)
        put_found(r, scale(value, 1.0 / weight), density)
    else:
        f = scale(value, walk.survival)
        r.technique = PATH
        r.tags = replayed_tags(walk)
        r.instance = source
        r.primitive = 0
        r.u = 0.0
        r.v = 0.0
        r.direction = 0
        r.flags = pack_flags(walk.vertex + 1, 0, 0, REPLAYED, 0)
        r.jacobian = 1.0
        put_found(r, (0.0, 0.0, 0.0), 0.0)
    offer(walk, path, by_class(path, f), path.bounce > 1, 1.0 / walk.survival)
    return 1


@inlined
def take_light_sample(scene, film, scratch, walk, path, sp, f, pdf, v, part):
    """Stream the LIGHT_SAMPLE in scratch, which f sends on from sp; v: how much of it arrives, part: of the mean."""
    ls = light_sample_in(scratch)
    r = path_reservoir_at(connection_of(walk), 0)
    r.light_group = sample_group(film, ls)
    is_delta = ls.flags & LIGHT_SAMPLE_DELTA != 0
    m = 1.0 if is_delta else mis_weight(ls.mis_pdf, pdf)
    from_tile = samples_tiles(scene)
    connected = walk.k == 0 and ls.seen_by & LOBE_RAYS == LOBE_RAYS and connects(walk, sp, pdf)
    measure = ls.point_pdf if from_tile else ls.pdf
    if not from_tile and walk.k == 0 and not connected:
        measure = point_pdf_of(scene, sp, ls)
    light = scale(mul(vec(ls.radiance), v), 1.0 / measure)
    integrand = lobe_scale(f, scale(light, m))
    if walk.k > 0:
        value = _beyond(walk, mul(vec(path.throughput), lobe_sum(integrand)))
        put_found(r, value, 0.0)
        value = mul(vec(walk.throughput), value)
    else:
        value = scale(mul(vec(path.throughput), lobe_sum(integrand)), walk.survival)
        if connected:
            put_connection(walk, path, sp, LIT_THERE, 1.0)
            r.direction = pack_direction(vec(ls.wi))
            put_found(r, light, -1.0 if is_delta else ls.mis_pdf)
        else:
            source, primitive, x, y = point_of_sample(scene, sp, ls)
            r.technique = PATH
            r.tags = tags_before(walk) if walk.vertex == 1 else replayed_tags(walk)
            r.instance = source
            r.primitive = primitive
            r.u = x
            r.v = y
            r.direction = 0
            r.flags = pack_flags(walk.vertex + 1, 0, 0, AT_LIGHT, 0)
            r.jacobian = 1.0
            put_found(r, (0.0, 0.0, 0.0), -1.0 if is_delta else ls.mis_pdf / measure)
    if path.bounce == 0:
        light = lobe_scale(integrand, scale(vec(path.throughput), walk.survival))
    else:
        light = by_class(path, value)
    offer(walk, path, light, path.bounce > 0, part * measure / (ls.pdf * walk.survival))


@inlined
def reconnect_here(walk, path, sp):
    """After a bounce at sp: let it be the path's vertex k, if it is the first one that is connectable."""
    pdf = bounce_pdf(path)
    if walk.k > 0 or not connects(walk, sp, pdf):
        return
    d = vec(path.d)
    if sp.n_closures > 1:
        pdf = label_pdf(sp, d, label_of_tag(tag_of(path.flags)))
    put_connection(walk, path, sp, WENT_ON, pdf)
    path_reservoir_at(connection_of(walk), 0).direction = pack_direction(d)
    walk.k = walk.vertex
    walk.bounces_there = path.bounce
    put(walk.throughput, scale(vec(path.throughput), walk.survival))
    walk.survival_before = walk.survival
    # Roulette goes on by the same number, and what comes from behind is known by itself.
    walk.behind = max3(vec(path.throughput))
    put(path.throughput, (walk.behind, walk.behind, walk.behind))
