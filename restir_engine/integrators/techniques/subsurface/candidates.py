"""The candidates of subsurface light: one probe, a light sample at each of its hits, of which one is kept.

The lobe by which the path goes on is chosen here as it is afterwards, so that one probe serves both: where it is not
one that scatters, the pixel has a null sample. The direction of entry and, of several closures that scatter, the one
that is sampled belong to the pixel's domain, like the place of the camera's ray in the pixel.

Each hit k is found with the density p_k of all lines and channels, its light with p_l. Resampling by p̂ without V keeps
one of them with W = Σ_k (p̂_k / (p_k p_l)) / p̂, and one shadow ray makes V a part of its p̂. Exits of light that goes
straight through or scatters once (HYBRID) are lit here, and the path goes on by one exit of all.
"""

from ....kernels.core import rng
from ....kernels.core.jit import device, inlined, kernel
from ....kernels.core.memory import (
    call_for_outcome,
    clear_record,
    copy_words,
    load_f64,
    record_address,
    store_f32,
    store_f64,
)
from ....kernels.core.records import (
    FILM,
    INTEGRATOR,
    SCENE,
    SCRATCH_PATH,
    closure_at,
    light_sample_in,
    path_at,
    path_in,
    tile_scene,
)
from ....kernels.core.vec import is_black, load3_f64, mul, put, scale, store3_f64, sub, vec
from ....kernels.film.contribute import point_group
from ....kernels.lights import light_is_sampled, light_sample, point_of_sample
from ....kernels.lobes.classes import NO_LOBES
from ....kernels.lobes.closure import P_BURLEY
from ....kernels.path.state import DIM_LIGHT, DIM_LIGHT_POINT, DIMENSIONS
from ....kernels.subsurface.bssrdf import (
    BSSRDF,
    BSSRDF_ALONE,
    BSSRDF_AND_EXITS,
    NONE,
    bssrdf_at,
    bssrdf_in,
    diffused,
)
from ....kernels.subsurface.exits import (
    DIM_EXIT,
    amount,
    choose_exit,
    exit_amounts,
    exit_at,
    exit_events,
    exit_weight,
    leave_by,
    light_one,
)
from ....kernels.subsurface.probe import H_LIT, H_NORMAL, H_POINT, H_PRIMITIVE, H_T, H_U, H_V, H_WEIGHT
from ....kernels.volume.calls import media_around
from ...resampling.frame import FRAME
from ...resampling.inputs import clear_groups, note_group, point_at, store_light
from ...resampling.options import REUSE
from ...resampling.reservoir import accept, clear, reservoir_at
from ..refraction.closures import is_served
from .sample import (
    NO_EXIT,
    NOT_SERVED,
    SUBSURFACE,
    TURNED,
    UNKNOWN_HIT,
    exit_of,
    found_by,
    point_of,
    sample_at,
    watched_of,
)
from .scatterer import scatterer_of
from .target import PATH_WORDS, brightness, copy_point, diffuse_lobes, irradiance, irradiance_by, visibility

BSSRDF_WORDS = BSSRDF.itemsize // 8
_DIM_CANDIDATE = 4  # besides those of exits
# The disk that neighbours are searched on: so many scales of the profile, but not less or more pixels than these.
SEARCH, LEAST_RADIUS, LARGEST_RADIUS = 2.0, 5.0, 30.0


@inlined
def _search_radius(b, sp):
    """How far neighbours may be, pixels."""
    d = max(float(b.d[0]), max(float(b.d[1]), float(b.d[2])))
    pixel = max(float(sp.dp), 1.0e-30)
    return min(max(SEARCH * d / pixel, LEAST_RADIUS), LARGEST_RADIUS)


@device
def _resample(scene, integrator, reuse, frame, scratch, pixel, sp, n, dimension, chance, last):
    """Light the first n exits and keep one in the pixel's reservoir; chance: with which there is a candidate."""
    path = path_at(frame.paths, pixel)
    u0 = rng.sample1(path.key, path.sample, dimension + DIM_LIGHT)
    u1, u2 = rng.sample2(path.key, path.sample, dimension + DIM_LIGHT_POINT)
    choice = rng.sample1(path.key, path.sample, dimension + _DIM_CANDIDATE)
    total, chosen = 0.0, -1
    source, primitive, u, v = 0, 0, 0.0, 0.0
    for k in range(n):
        weight = exit_weight(scratch, k)
        if is_black(weight):
            continue
        leave_by(scene, scratch, sp, k)
        if not light_sample(scene, sp, scratch, u1, u2, u0):
            continue
        ls = light_sample_in(scratch)
        f = brightness(reuse, mul(weight, irradiance_by(scene, sp, ls)))
        w = f * ls.point_pdf / ls.pdf
        if not 0.0 < w < 1.0e30:
            continue
        total += w
        taken, choice = accept(w, total, choice)
        if taken:
            chosen = k
            source, primitive, u, v = point_of_sample(scene, sp, ls)
    if chosen < 0:
        return
    leave_by(scene, scratch, sp, chosen)
    e = irradiance(scene, scratch, source, primitive, u, v)
    hit = exit_at(scratch, chosen)
    b = bssrdf_in(scratch)
    s = diffused(b, sub(load3_f64(hit, H_POINT), vec(b.p)), load3_f64(hit, H_NORMAL))
    target = brightness(reuse, mul(s, e))
    if not target > 0.0:
        return
    e = mul(e, visibility(scene, integrator, frame, scratch, pixel))
    f = mul(s, e)
    seen = brightness(reuse, f)
    if not seen > 0.0:
        return
    r = sample_at(frame.reservoirs, pixel)
    r.contribution_weight = total / target / chance
    r.target = seen
    r.seed = rng.hash_combine(path.key, path.sample)
    r.flags = found_by(b.line, b.channel, min(chosen, UNKNOWN_HIT)) | (TURNED if b.side < 0.0 else 0)
    r.instance = b.instance
    r.primitive = int(load_f64(hit, H_PRIMITIVE))
    r.u = load_f64(hit, H_U)
    r.v = load_f64(hit, H_V)
    r.source = source
    r.light_primitive = primitive
    r.light_u = u
    r.light_v = v
    put(r.irradiance, e)
    r.light_group = point_group(frame.light_groups, source, primitive)
    w = float(r.contribution_weight) if last != 0 else 1.0
    store_light(frame, reuse, pixel, diffuse_lobes(scale(f, w)))
    note_group(frame, reuse, pixel, int(r.light_group), diffuse_lobes(scale(f, w)))


@device
def _go_on(scene, integrator, film, frame, scratch, pixel, sp, n, lit, crossing, dimension, chance):
    """Light all but the first `lit` of n exits, and choose the one by which the path goes on.

    crossing: whether that of light that crosses straight is lit, too.
    """
    way = exit_of(frame, pixel)
    path = path_in(scratch)
    copy_words(record_address(path), record_address(path_at(frame.paths, pixel)), PATH_WORDS)
    path.dimension = dimension
    factor = scale(vec(path.throughput), 1.0 / chance)
    for k in range(n):
        store3_f64(exit_at(scratch, k), H_WEIGHT, mul(exit_weight(scratch, k), factor))
        done = k < lit or (crossing and exit_events(scratch, k) == 0)
        store_f64(exit_at(scratch, k), H_LIT, 1.0 if done else 0.0)
    total, most = exit_amounts(scratch, n)
    if not 0.0 < total < 1.0e30:
        return
    if lit < n and light_is_sampled(scene):
        media_around(scene, integrator, scratch, path, point_at(frame, pixel))
        light_one(scene, integrator, film, scratch, path, sp, n, most, True, True)
    k = choose_exit(scratch, n, total, rng.sample1(path.key, path.sample, dimension + DIM_EXIT))
    place, weight = exit_at(scratch, k), exit_weight(scratch, k)
    way.primitive = int(load_f64(place, H_PRIMITIVE))
    way.u = load_f64(place, H_U)
    way.v = load_f64(place, H_V)
    way.t = load_f64(place, H_T)
    for axis in range(3):
        way.normal[axis] = load_f64(place, H_NORMAL + axis)
    put(way.weight, scale(weight, total / amount(weight)))
    way.events = exit_events(scratch, k)
    way.dimension = dimension + DIMENSIONS


@device
def _draw(scene, integrator, film, reuse, frame, scratch, pixel, medium, burley, refraction, last):
    """Fill a pixel's domain, its reservoir and its exit."""
    kept, path = point_at(frame, pixel), path_at(frame.paths, pixel)
    scatterer, share, taken, chance = scatterer_of(kept, path)
    if scatterer < 0:
        return
    c = closure_at(kept.closures, scatterer)
    code = burley if c.p[P_BURLEY] != 0.0 else medium
    if code == 0:
        return
    way = exit_of(frame, pixel)
    way.primitive = NO_EXIT
    sp = copy_point(frame, scratch, pixel)
    room = sp.closures
    sp.closures = kept.closures
    sp.n_closures = kept.n_closures
    sp.scatterer = scatterer
    copy_words(scratch + SCRATCH_PATH, record_address(path), PATH_WORDS)
    going = path_in(scratch)
    put(going.throughput, scale(vec(c.weight), 1.0 / share))
    wanted = BSSRDF_AND_EXITS if taken else BSSRDF_ALONE
    bssrdf_in(scratch).kind = NONE
    addresses = record_address(scene), record_address(integrator), record_address(film)
    n = call_for_outcome(code, addresses[0], addresses[1], addresses[2], scratch, wanted)
    dimension = going.dimension
    sp.closures = room
    if n < 0:
        return
    b = bssrdf_in(scratch)
    if b.kind != NONE:
        copy_words(point_of(frame, pixel), record_address(b), BSSRDF_WORDS)
        reservoir_at(frame.reservoirs, pixel).confidence = 1.0
        store_f32(frame.radii, pixel, _search_radius(b, kept))
    if not taken:
        return
    lit = 0
    while lit < n and exit_events(scratch, lit) >= 2:
        lit += 1
    if lit > 0 and light_is_sampled(scene):
        _resample(scene, integrator, reuse, frame, scratch, pixel, sp, lit, dimension, chance, last)
    crossing = refraction != 0 and is_served(c)
    _go_on(scene, integrator, film, frame, scratch, pixel, sp, n, lit, crossing, dimension, chance)


@kernel
def subsurface_candidates_tile(
    scene: SCENE, integrator: INTEGRATOR, film: FILM, reuse: REUSE, frame: FRAME, scratch, medium, burley,
    refraction, x0, y0, x1, y1, last,
):  # fmt: skip
    """Fill the domains, reservoirs and exits of a tile; `frame` is the companion.

    medium, burley: code of kernels.subsurface.methods.EXITS for media and for materials that ask for BURLEY, 0: they
    are not served. refraction: whether what crosses straight is resampled by itself. last: whether no reuse follows, so
    that frame.light is what lights.
    """
    scene = tile_scene(scene, scratch, 0)
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = y * frame.width + x
            scene.time = point_at(frame, pixel).time
            r = reservoir_at(frame.reservoirs, pixel)
            clear(r, 0.0)
            r.technique = SUBSURFACE
            store_light(frame, reuse, pixel, NO_LOBES)
            clear_groups(frame, reuse, pixel)
            bssrdf_at(point_of(frame, pixel), 0).kind = NONE
            exit_of(frame, pixel).primitive = NOT_SERVED
            clear_record(watched_of(frame, pixel))
            if point_at(frame, pixel).instance >= 0:
                _draw(scene, integrator, film, reuse, frame, scratch, pixel, medium, burley, refraction, last)
