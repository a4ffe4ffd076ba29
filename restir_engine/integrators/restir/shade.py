"""The last steps of a frame: a reservoir's light is added, the path goes on, and the film takes the frame in."""

from ...kernels.core.jit import inlined, kernel
from ...kernels.core.memory import call_entry, call_for_outcome, load_i64, record_address
from ...kernels.core.records import (
    CAMERA,
    FILM,
    INTEGRATOR,
    SCENE,
    SCRATCH_PATH,
    path_at,
    shading_point_at,
    tile_camera,
    tile_point,
    tile_scene,
)
from ...kernels.core.vec import mul, vec
from ...kernels.film.contribute import contribute, contribute_to_groups, lit_by_several
from ...kernels.film.frame_pixels import add_pixels
from ...kernels.geometry.intersect import put_nearest
from ...kernels.lobes.classes import lobe_sum
from ...kernels.path.shutter import set_time
from ...kernels.path.state import ARRIVES, COUNTED, ENTERS, GOES_ON
from ..path.bounce import bounce
from ..path.trace import trace_path
from ..resampling.frame import FRAME, UNTRACED, hit_at
from ..resampling.inputs import light_by_group, load_light
from ..resampling.vertex import take_up


@inlined
def _add_light(integrator, film, path, frame, pixel):
    """Add what candidates or reuse have left as a pixel's direct light."""
    f = load_light(frame, pixel)
    value = mul(lobe_sum(f), vec(path.throughput))
    contribute(integrator, film, path, value, lit_by_several(path, f))
    if frame.light_groups != 0:
        contribute_to_groups(integrator, film, path, value, light_by_group(frame, pixel))


@kernel
def shade_tile(
    scene: SCENE, camera: CAMERA, integrator: INTEGRATOR, film: FILM, frame: FRAME, scratch, exit_lights,
    lights, n_lights, companion, go_on, method, x0, y0, x1, y1,
):  # fmt: skip
    """Light the vertices of a tile and follow their paths on; exit_lights: see `trace_path`.

    lights: int64 [n_lights, 2], addresses of a FRAME of light from below and of the code that adds it. go_on: code of
    how paths go on below the surface by what the FRAME at `companion` has chosen; method: code that follows those for
    which nothing was chosen (see kernels.subsurface.methods). Each 0: there is none.
    """
    scene, camera = tile_scene(scene, scratch, 0), tile_camera(camera, scratch, 0)
    path = path_at(scratch + SCRATCH_PATH, 0)
    for y in range(y0, y1):
        for x in range(x0, x1):
            index = y * frame.width + x
            if shading_point_at(frame.points, index).instance < 0:
                continue
            sp = tile_point(scratch)
            set_time(scene, camera, path_at(frame.paths, index).time)
            take_up(scene, integrator, frame, scratch, path, sp, index)
            _add_light(integrator, film, path, frame, index)
            for k in range(n_lights):
                at, add_light = load_i64(lights, 2 * k), load_i64(lights, 2 * k + 1)
                call_entry(add_light, record_address(integrator), record_address(film), at, scratch, index)
            event = bounce(scene, integrator, path, sp)
            at = record_address(scene), record_address(integrator), record_address(film)
            if event == ENTERS and go_on != 0:
                event = call_for_outcome(go_on, at[0], at[1], companion, scratch, index)
            if event == GOES_ON and path.mis_pdf > 0.0:
                path.mis_pdf = COUNTED
            if event == ENTERS and method != 0:
                event = call_for_outcome(method, at[0], at[1], at[2], scratch, 0)
            hit = hit_at(frame.hits, index)
            if event == GOES_ON and hit.instance != UNTRACED:
                put_nearest(scratch, 1.0 * hit.t, int(hit.instance), int(hit.primitive), 1.0 * hit.u, 1.0 * hit.v)
                event = ARRIVES
            trace_path(scene, camera, integrator, film, scratch, event, exit_lights)


@kernel
def film_tile(film: FILM, frame: FRAME, x0, y0, x1, y1):
    """Add the frame's pixels to the film's."""
    add_pixels(film, frame.pixels, frame.width, x0, y0, x1, y1)
