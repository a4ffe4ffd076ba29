"""The time of a path, and what the camera is like then.

A path has one time from its start to its end. Its share of the light that the shutter lets in is uniform, and the time
is where the shutter's curve has let in that share (the inverse of its cumulated curve). A rolling shutter reads the
lines of the picture one after the other: with a line's duration d, by that of all of them, the line at height h (0 at
the bottom, 1 at the top) is open around 1/2 + (1/2 - h) (1 - d), for d of the time.

The camera goes from step to step as instances do: translation, stretch and frame linearly, rotation along the arc.
"""

import math

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
    rotation = _rotation_matrix(_slerp(before.rotation, after.rotation, share))
    m = camera.to_world
    for i in range(3):
        m[4 * i + 3] = _between(before.translation[i], after.translation[i], share)
        for j in range(3):
            stretched = 0.0
            for k in range(3):
                stretch = _between(before.stretch[3 * k + j], after.stretch[3 * k + j], share)
                stretched += rotation[3 * i + k] * stretch
            m[4 * i + j] = stretched
    invert(m, camera.to_camera)
    for i in range(4):
        camera.screen[i] = _between(before.screen[i], after.screen[i], share)
    camera.aperture = _between(before.aperture, after.aperture, share)
    camera.focus_distance = _between(before.focus_distance, after.focus_distance, share)


@inlined
def _between(a, b, share):
    return a + (b - a) * share


@device
def _slerp(q, r, share):
    """The unit quaternion between two, which `scene.motion` has given the shorter arc."""
    cosine = q[0] * r[0] + q[1] * r[1] + q[2] * r[2] + q[3] * r[3]
    a, b = 1.0 - share, share
    if cosine < 0.9995:
        angle = math.acos(max(cosine, -1.0))
        a, b = math.sin(a * angle), math.sin(b * angle)
    w, x, y, z = q[0] * a + r[0] * b, q[1] * a + r[1] * b, q[2] * a + r[2] * b, q[3] * a + r[3] * b
    s = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return w * s, x * s, y * s, z * s


@device
def _rotation_matrix(q):
    """The matrix of a unit quaternion (w, x, y, z), by rows."""
    w, x, y, z = q
    return (
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
        2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y),
    )  # fmt: skip
