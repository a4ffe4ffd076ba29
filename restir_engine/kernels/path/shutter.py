"""The time of a path, and what the camera is like then.

A path has one time from its start to its end. Its share of the light that the shutter lets in is uniform, and the time
is where the shutter's curve has let in that share (the inverse of its cumulated curve). A rolling shutter reads the
lines of the picture one after the other: with a line's duration d, by that of all of them, the line at height h (0 at
the bottom, 1 at the top) is open around 1/2 + (1/2 - h) (1 - d), for d of the time.

The camera goes from step to step as instances do, on lines that follow its arc, in double precision.
"""

from ..core.jit import device, entry, inlined
from ..core.memory import call_entry, load_f32, record_address
from ..core.records import (
    SHUTTER_TABLE_SIZE,
    camera_at,
    camera_step_at,
    scene_at,
    shutter_at,
)
from ..geometry.placed import invert, segment


@device
def shutter_time(shutter, camera, u, y):
    """When a path begins that comes from line y of the film; u: a uniform number."""
    place = u * (SHUTTER_TABLE_SIZE - 1)
    i = min(int(place), SHUTTER_TABLE_SIZE - 2)
    a = load_f32(shutter.table, i)
    time = a + (load_f32(shutter.table, i + 1) - a) * (place - i)
    if shutter.rolling != 0:
        line = 1.0 - (y + camera.region_y) / camera.height
        time = 0.5 + (time - 0.5) * shutter.duration + (line - 0.5) * (1.0 - shutter.duration)
    return min(max(time, 0.0), 1.0)


@inlined
def set_time(scene, camera, time):
    """Let a tile's own scene and camera be as they are at a time."""
    scene.time = time
    if camera.n_steps > 0 and scene.shutter != 0:
        call_entry(shutter_at(scene.shutter, 0).aim, record_address(scene), record_address(camera), 0, 0, 0)


@entry
def aim(scene, camera, a, b, c):
    """Turn a tile's own camera to where it looks at the scene's time."""
    camera = camera_at(camera, 0)
    step, share = segment(scene_at(scene, 0).time, camera.n_steps)
    before, after = camera_step_at(camera.steps, step), camera_step_at(camera.steps, step + 1)
    for i in range(12):
        camera.to_world[i] = _between(before.to_world[i], after.to_world[i], share)
    invert(camera.to_world, camera.to_camera)
    for i in range(4):
        camera.screen[i] = _between(before.screen[i], after.screen[i], share)
    camera.aperture = _between(before.aperture, after.aperture, share)
    camera.focus_distance = _between(before.focus_distance, after.focus_distance, share)


@inlined
def _between(a, b, share):
    return a + (b - a) * share
