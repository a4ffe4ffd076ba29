"""The candidates of light that crosses straight: directions of entry, a light behind each, of which one stays.

A direction is found with the density p that is a part of its integrand, and the light with p_l. Resampling by p̂ without
V keeps one of n with W = Σ_k (p̂_k / (p p_l)) / (n p̂), and one shadow ray makes V a part of its p̂. Directions are drawn
whatever lobe the path takes; of several closures that scatter, one is chosen, which belongs to the pixel's domain.
"""

from ....kernels.core import rng
from ....kernels.core.jit import device, kernel
from ....kernels.core.records import INTEGRATOR, SCENE, closure_at, light_sample_in, path_at, tile_scene
from ....kernels.core.vec import dot, is_black, max3, mul, put, scale, vec
from ....kernels.film.contribute import point_group
from ....kernels.lights import light_is_sampled, light_sample, point_of_sample
from ....kernels.lobes.classes import NO_LOBES
from ....kernels.subsurface.entry import entry_direction
from ....kernels.subsurface.exit import leave
from ....kernels.subsurface.hybrid import first_hit
from ....kernels.subsurface.scales import channels
from ...resampling.frame import FRAME
from ...resampling.inputs import clear_groups, note_group, point_at, store_light
from ...resampling.options import REUSE
from ...resampling.reservoir import accept, clear, reservoir_at
from ..subsurface.sample import TURNED, sample_at
from ..subsurface.target import brightness, copy_point, diffuse_lobes, irradiance, irradiance_by, place_of, visibility
from .closures import is_served
from .sample import NOT_SERVED, REFRACTION, entry_of
from .target import crossing, density_of

_STREAM = 0x52454652  # of the path's key
_DIM_ENTRY, _DIM_POINT, _DIM_LIGHT, _DIM_CANDIDATE, _DIM_CLOSURE = range(5)


@device
def _choose_closure(frame, pixel, u):
    """Fill the pixel's ENTRY; False where no closure is served."""
    sp, way = point_at(frame, pixel), entry_of(frame, pixel)
    way.closure = NOT_SERVED
    total = 0.0
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        if is_served(c):
            total += c.sample_weight
    left = u * total
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        if is_served(c) and left >= 0.0:
            way.closure = i
            left -= c.sample_weight
    if way.closure == NOT_SERVED:
        return False
    c = closure_at(sp.closures, way.closure)
    weight, sigma_t, _ = channels(c, scale(vec(c.weight), total / c.sample_weight))
    put(way.weight, weight)
    put(way.sigma_t, sigma_t)
    if not max3(weight) > 0.0:
        way.closure = NOT_SERVED
    return way.closure != NOT_SERVED


@device
def _draw(scene, integrator, reuse, frame, scratch, pixel, samples, last):
    """Fill a pixel's domain and its reservoir."""
    kept, path = point_at(frame, pixel), path_at(frame.paths, pixel)
    key = rng.hash_combine(path.key, _STREAM)
    first = path.sample * samples
    if not _choose_closure(frame, pixel, rng.sample1(key, first, _DIM_CLOSURE)):
        return
    r = sample_at(frame.reservoirs, pixel)
    r.confidence = 1.0
    if not light_is_sampled(scene):
        return
    c = closure_at(kept.closures, entry_of(frame, pixel).closure)
    o = vec(kept.p)
    sp = copy_point(frame, scratch, pixel)
    choice = rng.sample1(key, first, _DIM_CANDIDATE)
    total, chosen, chosen_t, e, at, best = 0.0, (0.0, 0.0, 0.0), -1.0, (0.0, 0.0, 0.0), -1, -1
    for k in range(first, first + samples):
        u0, u1 = rng.sample2(key, k, _DIM_ENTRY)
        enters, d = entry_direction(kept, c, u0, u1)
        if not enters:
            continue
        t, primitive, u, v = first_hit(scene, scratch, kept, o, d)
        if primitive < 0:
            continue
        left = crossing(frame, pixel, t)
        if is_black(left):
            continue
        leave(scene, sp, primitive, u, v, t, d)
        at = k
        v0, v1 = rng.sample2(key, k, _DIM_POINT)
        if not light_sample(scene, sp, scratch, v0, v1, rng.sample1(key, k, _DIM_LIGHT)):
            continue
        ls = light_sample_in(scratch)
        here = irradiance_by(scene, sp, ls)
        w = brightness(reuse, mul(left, here)) * ls.point_pdf / ls.pdf
        if not 0.0 < w < 1.0e30:
            continue
        total += w
        taken, choice = accept(w, total, choice)
        if taken:
            chosen, chosen_t, e, best = d, t, here, k
            r.instance = kept.instance
            r.primitive = primitive
            r.u = u
            r.v = v
            source, light_primitive, light_u, light_v = point_of_sample(scene, sp, ls)
            r.source = source
            r.light_primitive = light_primitive
            r.light_u = light_u
            r.light_v = light_v
    if best < 0:
        return
    if at != best:
        leave(scene, sp, int(r.primitive), float(r.u), float(r.v), chosen_t, chosen)
        e = irradiance(scene, scratch, int(r.source), int(r.light_primitive), float(r.light_u), float(r.light_v))
    left = scale(crossing(frame, pixel, chosen_t), density_of(frame, pixel, chosen))
    _keep(scene, integrator, reuse, frame, scratch, pixel, chosen, left, e, total / samples, last)


@device
def _keep(scene, integrator, reuse, frame, scratch, pixel, d, left, e, total, last):
    """Complete the reservoir of a pixel whose SAMPLE stands there, its x₂ and LIGHT_SAMPLE in working memory.

    left: rgb, f by E; e: E without V; total: the mean of the candidates' weights.
    """
    path, r = path_at(frame.paths, pixel), sample_at(frame.reservoirs, pixel)
    target = brightness(reuse, mul(left, e))
    if not target > 0.0:
        return
    e = mul(e, visibility(scene, integrator, frame, scratch, pixel))
    f = mul(left, e)
    seen = brightness(reuse, f)
    if not seen > 0.0:
        return
    r.flags = 0
    _, n = place_of(scene, r)
    if dot(n, d) < 0.0:
        r.flags = TURNED
    r.contribution_weight = total / target
    r.target = seen
    r.seed = rng.hash_combine(path.key, path.sample)
    put(r.irradiance, e)
    r.light_group = point_group(frame.light_groups, int(r.source), int(r.light_primitive))
    w = float(r.contribution_weight) if last != 0 else 1.0
    store_light(frame, reuse, pixel, diffuse_lobes(scale(f, w)))
    note_group(frame, reuse, pixel, int(r.light_group), diffuse_lobes(scale(f, w)))


@kernel
def refraction_candidates_tile(
    scene: SCENE, integrator: INTEGRATOR, reuse: REUSE, frame: FRAME, scratch, samples, x0, y0, x1, y1, last
):
    """Fill the domains and reservoirs of a tile; `frame` is the companion.

    samples: directions a pixel; last: whether no reuse follows, so that frame.light is what lights.
    """
    scene = tile_scene(scene, scratch, 0)
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = y * frame.width + x
            scene.time = point_at(frame, pixel).time
            r = reservoir_at(frame.reservoirs, pixel)
            clear(r, 0.0)
            r.technique = REFRACTION
            store_light(frame, reuse, pixel, NO_LOBES)
            clear_groups(frame, reuse, pixel)
            entry_of(frame, pixel).closure = NOT_SERVED
            if point_at(frame, pixel).instance >= 0:
                _draw(scene, integrator, reuse, frame, scratch, pixel, samples, last)
