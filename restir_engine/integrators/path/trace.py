"""The loop over a path's vertices."""

from ...kernels.core.jit import inlined
from ...kernels.core.records import (
    RAY_CAMERA,
    SCRATCH_PATH,
    path_at,
    tile_point,
)
from ...kernels.core.vec import vec
from ...kernels.geometry.camera import camera_reach
from ...kernels.geometry.intersect import trace
from ...kernels.geometry.leaving import trace_leaving
from ...kernels.path.direct import direct_light
from ...kernels.path.state import ARRIVES, ENDS, ENTERS, FAR, GOES_ON, LIT, SHADES, ray_mask
from ...kernels.subsurface.methods import scatter
from .bounce import bounce
from .vertex import arrive


@inlined
def trace_path(scene, camera, integrator, film, scratch, event, exit_lights):
    """Follow the path in scratch until it leaves the scene, is absorbed, or may not go on.

    `event` is what comes first: GOES_ON with its ray, ARRIVES with the hit in scratch, SHADES, LIT or ENTERS at its
    shading point. exit_lights: light samples where light leaves the first object below whose surface it is scattered.
    """
    path = path_at(scratch + SCRATCH_PATH, 0)
    sp = tile_point(scratch)
    light_samples = 1
    while event != ENDS:
        if event == GOES_ON:
            trace_ray(scene, camera, scratch, path)
            event = ARRIVES
        if event == ARRIVES:
            event = arrive(scene, camera, integrator, film, scratch, path, sp)
            light_samples = 1
        if event == SHADES:
            direct_light(scene, integrator, film, scratch, path, sp, light_samples)
            event = LIT
        if event == LIT:
            event = bounce(scene, integrator, path, sp)
        if event == ENTERS:
            event = scatter(scene, integrator, film, scratch, path, sp)
            light_samples = exit_lights if path.bounce == 0 else 1


@inlined
def trace_ray(scene, camera, scratch, path):
    """Trace the path's ray, for `arrive`."""
    d = vec(path.d)
    reach = camera_reach(camera, d) if path.flags & RAY_CAMERA else FAR
    o, mask = vec(path.o), ray_mask(path.flags)
    if path.left > 0:
        trace_leaving(scene, scratch, o, d, path.run_up, reach, mask, path.left - 1)
    else:
        trace(scene, scratch, o, d, path.tmin, reach, mask)
