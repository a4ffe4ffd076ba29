"""The last steps of a frame: a reservoir's light is added, the path goes on, and the film takes the frame in."""

from ...kernels.accumulate import add1
from ...kernels.direct import add_direct, lit_bsdf, lobe_sum
from ...kernels.jit import inlined, kernel
from ...kernels.lights import light_point
from ...kernels.media.calls import media_around
from ...kernels.memory import load_f32, record_address
from ...kernels.records import (
    LIGHT_SAMPLE_NO_SHADOW,
    SCRATCH_CLOSURES,
    SCRATCH_LIGHT_SAMPLE,
    SCRATCH_PATH,
    light_sample_at,
    path_at,
    shading_point_at,
)
from ...kernels.shadow import transmittance
from ...kernels.vec import mul, scale, vec
from ..path import GOES_ON, bounce, tile_point, trace_path
from .gbuffer import CLOSURE_WORDS, PATH_WORDS, POINT_WORDS, copy_words
from .reservoir import UNKNOWN, reservoir_at

# In place of PATH.mis_pdf: so small that what light sampling finds with any density has no weight.
COUNTED = 1e-200


@inlined
def _add_sample(scene, integrator, film, scratch, path, sp, r):
    """Add f W of a pixel's own reservoir."""
    if r.contribution_weight <= 0.0:
        return
    if not light_point(scene, sp, scratch, int(r.source), int(r.primitive), 1.0 * r.u, 1.0 * r.v):
        return
    ls = light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)
    wi = vec(ls.wi)
    f, _ = lit_bsdf(scene, sp, wi, ls.visibility)
    c = scale(mul(lobe_sum(f), vec(ls.radiance)), r.contribution_weight / ls.pdf)
    if r.visibility[0] != UNKNOWN:
        c = mul(c, (1.0 * r.visibility[0], 1.0 * r.visibility[1], 1.0 * r.visibility[2]))
    elif not ls.flags & LIGHT_SAMPLE_NO_SHADOW:
        c = mul(c, transmittance(scene, integrator, scratch, path, sp, wi, ls.distance, vec(ls.p)))
    add_direct(integrator, film, path, mul(c, vec(path.throughput)), f)


@inlined
def _add_sum(integrator, film, path, light):
    """Add direct light that reuse has summed up by class of lobes (float32 [9])."""
    f = (
        load_f32(light, 0), load_f32(light, 1), load_f32(light, 2),
        load_f32(light, 3), load_f32(light, 4), load_f32(light, 5),
        load_f32(light, 6), load_f32(light, 7), load_f32(light, 8),
    )  # fmt: skip
    add_direct(integrator, film, path, mul(lobe_sum(f), vec(path.throughput)), f)


@kernel
def shade_tile(scene, camera, integrator, film, frame, scratch, exit_lights, x0, y0, x1, y1):
    """Light the vertices of a tile and follow their paths on; exit_lights: see `trace_path`."""
    path = path_at(scratch + SCRATCH_PATH, 0)
    for y in range(y0, y1):
        for x in range(x0, x1):
            index = y * frame.width + x
            kept = shading_point_at(frame.points, index)
            if kept.instance < 0:
                continue
            sp = tile_point(scratch)
            copy_words(record_address(path), record_address(path_at(frame.paths, index)), PATH_WORDS)
            registers = sp.registers
            copy_words(scratch + SCRATCH_CLOSURES, kept.closures, CLOSURE_WORDS * kept.n_closures)
            copy_words(record_address(sp), record_address(kept), POINT_WORDS)
            sp.closures = scratch + SCRATCH_CLOSURES
            sp.registers = registers
            media_around(scene, integrator, scratch, path, sp)
            if frame.light != 0:
                _add_sum(integrator, film, path, frame.light + 36 * index)
            else:
                _add_sample(scene, integrator, film, scratch, path, sp, reservoir_at(frame.reservoirs, index))
            step = bounce(scene, integrator, path, sp)
            if step == GOES_ON and path.mis_pdf > 0.0:
                path.mis_pdf = COUNTED
            trace_path(scene, camera, integrator, film, scratch, step, exit_lights)


@kernel
def film_tile(film, frame, x0, y0, x1, y1):
    """Add the frame's pixels to the film's."""
    for y in range(y0, y1):
        for k in range((y * frame.width + x0) * frame.channels, (y * frame.width + x1) * frame.channels):
            add1(film.pixels, k, load_f32(frame.pixels, k))
