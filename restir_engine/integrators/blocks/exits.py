"""A path that enters below a surface, in a block: its domain, the exits that are lit for all, and its way on."""

from ...kernels.core import rng
from ...kernels.core.jit import device
from ...kernels.core.memory import call_for_outcome, copy_words, load_f64, record_address, store_f64
from ...kernels.core.records import PATH, closure_at, light_sample_in
from ...kernels.core.vec import is_black, load3_f64, mul, put, scale, store3_f64, sub, vec
from ...kernels.film.contribute import first_scattering, sample_group
from ...kernels.lights import light_sample, note_choice
from ...kernels.lobes.closure import P_BURLEY
from ...kernels.path.direct import lit_bsdf, scattered_light
from ...kernels.path.shadow import light_visibility
from ...kernels.path.state import COUNTED, DIM_LIGHT, DIM_LIGHT_POINT, DIMENSIONS, ENDS, ENTERS, GOES_ON
from ...kernels.subsurface.bssrdf import BSSRDF_ALONE, BSSRDF_AND_EXITS, NONE, bssrdf_in
from ...kernels.subsurface.exits import (
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
from ...kernels.subsurface.probe import H_LIT, H_NORMAL, H_PDF, H_POINT, H_WEIGHT
from ..path.bounce import bounce
from ..techniques.subsurface.scatterer import scatterer_of
from .block import MOST_LIT, block_at, path_of, put_domain, sample_of

_PATH_WORDS = PATH.itemsize // 8
_DIM_CHOICE = 4  # besides those of exits


@device
def _light_exits(scene, integrator, film, scratch, block, path, sp, lane, n, dimension):
    """Note of n exits, all of diffused light, so many as samples, with a light sample each: chosen by their weights."""
    total = 0.0
    for k in range(n):
        total += amount(exit_weight(scratch, k))
    if not 0.0 < total < 1.0e30:
        return
    b = block_at(block, 0)
    u0 = rng.sample1(path.key, path.sample, dimension + DIM_LIGHT)
    u1, u2 = rng.sample2(path.key, path.sample, dimension + DIM_LIGHT_POINT)
    before = rng.sample1(path.key, path.sample, dimension + _DIM_CHOICE)
    for k in range(n):
        chance = min(MOST_LIT * amount(exit_weight(scratch, k)) / total, 1.0)
        behind = before + chance
        chosen = int(behind) > int(before)
        before = behind
        hit = exit_at(scratch, k)
        pdf = load_f64(hit, H_PDF)
        if not (chosen and pdf > 0.0):
            continue
        leave_by(scene, scratch, sp, k)
        if not light_sample(scene, sp, scratch, u1, u2, u0):
            continue
        ls = light_sample_in(scratch)
        f, _ = lit_bsdf(scene, sp, vec(ls.wi), ls.seen_by)
        e = scattered_light(scratch, f, 0.0)
        if is_black(e):
            continue
        e = scale(mul(e, light_visibility(scene, integrator, scratch, path, sp)), 1.0 / (chance * pdf))
        if is_black(e) or not abs(e[0]) + abs(e[1]) + abs(e[2]) < 1.0e30:
            continue
        s = sample_of(block, b.samples)
        b.samples += 1
        put(s.p, sub(load3_f64(hit, H_POINT), vec(b.origin)))
        put(s.n, load3_f64(hit, H_NORMAL))
        put(s.irradiance, e)
        s.lane = lane
        s.group = sample_group(film, ls)


@device
def enter_block(scene, integrator, film, scratch, block, path, sp, medium, burley):
    """Take a path into a block at a surface below which light scatters, lit already; its next event."""
    scatterer, share, taken, chance = scatterer_of(sp, path)
    if scatterer < 0:
        return bounce(scene, integrator, path, sp)
    c = closure_at(sp.closures, scatterer)
    code = burley if c.p[P_BURLEY] != 0.0 else medium
    if code == 0:
        return bounce(scene, integrator, path, sp)
    b = block_at(block, 0)
    lane = b.domains
    kept = path_of(block, lane)
    copy_words(record_address(kept), record_address(path), _PATH_WORDS)
    if taken:
        event = bounce(scene, integrator, path, sp)
        if event != ENTERS:
            return event
    sp.scatterer = scatterer
    put(path.throughput, scale(vec(c.weight), 1.0 / share))
    bssrdf = bssrdf_in(scratch)
    bssrdf.kind = NONE
    wanted = BSSRDF_AND_EXITS if taken else BSSRDF_ALONE
    addresses = record_address(scene), record_address(integrator), record_address(film)
    n = call_for_outcome(code, addresses[0], addresses[1], addresses[2], scratch, wanted)
    dimension = path.dimension
    if n >= 0 and bssrdf.kind != NONE:
        put_domain(block, kept, bssrdf, chance * bssrdf.looks)
    if not taken:
        copy_words(record_address(path), record_address(kept), _PATH_WORDS)
        return bounce(scene, integrator, path, sp)
    if n <= 0:
        return ENDS
    lit = 0
    while lit < n and exit_events(scratch, lit) >= 2:
        lit += 1
    put(path.throughput, vec(kept.throughput))
    if lit > 0:
        _light_exits(scene, integrator, film, scratch, block, path, sp, lane, lit, dimension)
    factor = scale(vec(kept.throughput), 1.0 / chance)
    for k in range(n):
        store3_f64(exit_at(scratch, k), H_WEIGHT, mul(exit_weight(scratch, k), factor))
        store_f64(exit_at(scratch, k), H_LIT, 1.0 if k < lit else 0.0)
    total, largest = exit_amounts(scratch, n)
    if not 0.0 < total < 1.0e30:
        return ENDS
    if lit < n:
        light_one(scene, integrator, film, scratch, path, sp, n, largest, True, False)
    k = choose_exit(scratch, n, total, rng.sample1(path.key, path.sample, dimension + DIM_EXIT))
    leave_by(scene, scratch, sp, k)
    if k >= lit:
        note_choice(scene, sp)  # for the weight of a light that the path's next ray hits
    weight = exit_weight(scratch, k)
    put(path.throughput, scale(weight, total / amount(weight)))
    path.scattering = first_scattering(path, exit_events(scratch, k))
    path.dimension = dimension + DIMENSIONS
    event = bounce(scene, integrator, path, sp)
    if k < lit and event == GOES_ON and path.mis_pdf > 0.0:
        path.mis_pdf = COUNTED
    return event
