"""The candidates of whole paths: each pixel's path goes on from vertex 1, and keeps one sample of what it finds.

What a path finds after it has been below a surface goes to the film as it does with PATH.
"""

from ....kernels.core import rng
from ....kernels.core.jit import inlined, kernel
from ....kernels.core.memory import record_address
from ....kernels.core.records import (
    CAMERA,
    FILM,
    INTEGRATOR,
    SCENE,
    SCRATCH_LIGHT_SAMPLE,
    SCRATCH_TAKER,
    light_sample_at,
    path_in,
    tile_point,
)
from ....kernels.core.vec import is_black, mul, put, scale, vec
from ....kernels.lights.mean_visibility import FIRST, LATER, learn
from ....kernels.lobes import bsdf_has_eval, is_blurred
from ....kernels.lobes.classes import NO_LOBES, lobe_scale, lobe_sum, lobes_of
from ....kernels.path.direct import add_control_variate, add_light_sample, direct_light, draw_light, lit_bsdf
from ....kernels.path.shadow import light_visibility
from ....kernels.path.state import (
    ARRIVES,
    DIM_FIRST_VERTEX,
    DIMENSIONS,
    ENDS,
    ENTERS,
    FAR,
    GOES_ON,
    LIT,
    SHADES,
    survival_probability,
)
from ....kernels.subsurface.methods import scatter
from ...path.bounce import bounce
from ...path.trace import trace_ray
from ...path.vertex import arrive
from ...resampling.frame import FRAME
from ...resampling.inputs import clear_groups, note_group, point_at, reservoirs_of, store_indirect, store_light
from ...resampling.options import INDIRECT_PATHS, reuse_at
from ...resampling.reservoir import INDIRECT, clear, contribution_weight, copy_reservoir, reservoir_at
from ...resampling.vertex import take_up
from .collect import reconnect_here, take_light_sample
from .sample import MOST_VERTICES, path_reservoir_at
from .walk import kept_of, note_bounce, start_walk, walk_of
from .work import VERTICES, count

# Keys of the paths' random numbers, and of the choice among samples.
_PATHS, _CHOICE = 0x50415448, 0x43484F49


@inlined
def _light_here(scene, integrator, film, scratch, walk, path, sp, count):
    """Light samples at the path's vertex: streamed, or at vertex 1 maybe added to the film."""
    if not bsdf_has_eval(sp):
        return
    first = walk.vertex == 1
    apart = first and reuse_at(walk.reuse, 0).paths == INDIRECT_PATHS
    for i in range(count):
        found = draw_light(scene, scratch, path, sp, path.sample * count + i)
        if first:
            taker, path.taker = path.taker, 0
            throughput = vec(path.throughput)
            put(path.throughput, vec(walk.prefix))
            add_control_variate(integrator, film, scratch, path, sp, 1.0 / count)
            if found and apart:
                ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
                f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
                add_light_sample(scene, integrator, film, scratch, path, sp, f, pdf, 1.0 / count)
            put(path.throughput, throughput)
            path.taker = taker
        if found and not apart:
            ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
            f, pdf = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
            if ls.pdf > 0.0 and not is_black(mul(lobe_sum(f), vec(ls.radiance))):
                v = light_visibility(scene, integrator, scratch, path, sp)
                learn(path.mean_visibility, FIRST if first else LATER, v)
                take_light_sample(scene, film, scratch, walk, path, sp, f, pdf, v, 1.0 / count)


@inlined
def _leave(walk, path):
    """From here on the film takes what the path finds, as of any other."""
    path.taker = 0
    throughput = mul(vec(path.throughput), vec(walk.prefix))
    if walk.k > 0:
        throughput = scale(mul(throughput, vec(walk.throughput)), 1.0 / (walk.behind * walk.survival_before))
    put(path.throughput, throughput)


@inlined
def _must_leave(walk, integrator, path, sp):
    """Whether nothing can be kept from the vertex sp on.

    Because a path has too many vertices before it is reconnected; or because filter glossy makes of lobes behind vertex
    k what depends on the bounces before it.
    """
    if path.taker == 0:
        return False
    if walk.k == 0:
        return walk.vertex >= MOST_VERTICES
    return integrator.filter_glossy < FAR and is_blurred(sp)


@inlined
def _follow(scene, camera, integrator, film, scratch, walk, path, sp, light_samples, exit_lights):
    """Follow the path from vertex 1 to its end: `path.trace.trace_path`, with what the walk notes of it."""
    event = SHADES
    while event != ENDS:
        if event == GOES_ON:
            trace_ray(scene, camera, scratch, path)
            event = ARRIVES
        if event == ARRIVES:
            survival = survival_probability(path, integrator)
            event = arrive(scene, camera, integrator, film, scratch, path, sp)
            walk.survival *= survival
            if event == SHADES:
                walk.vertex += 1
                light_samples = 1
                if _must_leave(walk, integrator, path, sp):
                    _leave(walk, path)
        if event == SHADES:
            if path.taker == 0:
                direct_light(scene, integrator, film, scratch, path, sp, light_samples)
            else:
                _light_here(scene, integrator, film, scratch, walk, path, sp, light_samples)
            event = LIT
        if event == LIT:
            event = bounce(scene, integrator, path, sp)
            if event == GOES_ON and path.taker != 0:
                reconnect_here(walk, path, sp)
                note_bounce(walk, path, sp)
        if event == ENTERS:
            if path.taker != 0:
                _leave(walk, path)
            event = scatter(scene, integrator, film, scratch, path, sp)
            light_samples = exit_lights if path.bounce == 0 else 1


@inlined
def _settle(reuse, frame, walk, pixel, path, last):
    """Fill the pixel's reservoir by what the walk has kept, and frame.light by its F, or by what lights."""
    reservoirs = reservoirs_of(frame, reuse, frame.reservoirs)
    clear(reservoir_at(reservoirs, pixel), 1.0)
    light = NO_LOBES
    if walk.target > 0.0:
        copy_reservoir(reservoirs + 64 * pixel, kept_of(walk))
        r = path_reservoir_at(reservoirs, pixel)
        r.contribution_weight = contribution_weight(float(walk.total), float(walk.target))
        r.confidence = 1.0
        r.target = walk.target
        r.seed = _signed(path.key)
        r.index = path.sample
        light = lobes_of(walk.f)
        if last != 0:
            w = float(r.contribution_weight)
            light = lobe_scale(light, (w, w, w))
    is_indirect = last != 0 and path_reservoir_at(reservoirs, pixel).flags & INDIRECT != 0
    store_light(frame, reuse, pixel, NO_LOBES if is_indirect else light)
    store_indirect(frame, pixel, light if is_indirect else NO_LOBES)
    if last != 0:
        clear_groups(frame, reuse, pixel)
        note_group(frame, reuse, pixel, int(path_reservoir_at(reservoirs, pixel).light_group), light)


@inlined
def _signed(key):
    return key - 4294967296 if key >= 2147483648 else key


@kernel
def paths_tile(
    scene: SCENE, camera: CAMERA, integrator: INTEGRATOR, film: FILM, frame: FRAME, reuse, taker, scratch,
    x0, y0, x1, y1, last,
):  # fmt: skip
    """Fill the reservoirs of a tile; reuse: address of REUSE, taker: of `take_found`.

    last: whether no reuse follows, so that frame.light is what lights.
    """
    options = reuse_at(reuse, 0)
    path = path_in(scratch)
    walk = walk_of(scratch)
    walk.code = taker
    walk.reuse = reuse
    walk.integrator = record_address(integrator)
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = y * frame.width + x
            walk.target = 0.0
            walk.total = 0.0
            if point_at(frame, pixel).instance >= 0:
                sp = tile_point(scratch)
                take_up(scene, integrator, frame, scratch, path, sp, pixel)
                start_walk(walk, options, sp)
                walk.bounces = path.bounce
                walk.survival = 1.0
                put(walk.prefix, vec(path.throughput))
                put(path.throughput, (1.0, 1.0, 1.0))
                path.key = rng.hash_combine(path.key, _PATHS + (path.sample >> 16))
                path.sample &= 0xFFFF
                walk.choice = rng.sample1(rng.hash_combine(path.key, _CHOICE), path.sample, 0)
                path.dimension = DIM_FIRST_VERTEX
                path.taker = scratch + SCRATCH_TAKER
                _follow(
                    scene, camera, integrator, film, scratch, walk, path, sp, options.light_samples, options.exit_lights
                )
                count(scratch, VERTICES, (path.dimension - DIM_FIRST_VERTEX) // DIMENSIONS + 1)
            _settle(options, frame, walk, pixel, path, last)
