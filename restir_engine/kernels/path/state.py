"""A path in progress (the PATH record): its events, its start, its random dimensions, its counters, when it ends."""

import math

from ..core import rng
from ..core.jit import device, inlined
from ..core.memory import clear_record, load_f32
from ..core.records import (
    FILTER_TABLE_SIZE,
    RAY_ALL,
    RAY_BURLEY_DIFFUSE,
    RAY_CAMERA,
    RAY_DIFFUSE,
    RAY_GLOSSY,
    RAY_LAST,
    RAY_REFLECT,
    RAY_SHADOW,
    RAY_SINGULAR,
    RAY_SUBSURFACE_DIFFUSE,
    RAY_TRANSMIT,
    RAY_TRANSPARENT,
    SCRATCH_PATH,
    path_at,
    shutter_at,
)
from ..core.vec import is_black, max3, mul, put, vec
from ..geometry.camera import camera_ray
from ..geometry.leaving import run_up
from ..lights.linking import SEES_ALL
from ..lobes.closure import LABEL_DIFFUSE, LABEL_GLOSSY, LABEL_REFLECT, LABEL_SINGULAR
from .baked import start_on_surface
from .shutter import set_time, shutter_time

FAR = 1.0e30

# In place of PATH.mis_pdf where light sampling has been counted in full: so small that what it finds with any density,
# as it does every lamp, has no weight.
COUNTED = 1.0e-200

# Values of `last` in a PATH record: the path may still find light on its ray and on surfaces that let it through, or
# may find light on its ray only.
LAST, LAST_BEFORE_SURFACE = 1, 2

# Events of a path: what comes next. Nothing; its ray is to be traced, or to be followed to what it has hit; the surface
# where it stands is to be lit by light samples, or has been, and scatters the path; light goes on below that surface.
ENDS, GOES_ON, ARRIVES, SHADES, LIT, ENTERS = 0, 1, 2, 3, 4, 5

# Random dimensions: those of the camera, one of data passes, then DIMENSIONS for each vertex of the path.
DIM_FILTER, DIM_LENS, DIM_TIME, DIM_DATA, DIM_FIRST_VERTEX = 0, 1, 2, 3, 4
DIM_LIGHT, DIM_LIGHT_POINT, DIM_LOBE, DIM_DIRECTION, DIM_ROULETTE, DIMENSIONS = 0, 1, 2, 3, 4, 5


@inlined
def filter_offset(table, u):
    """A pixel filter's inverse distribution at u."""
    position = u * (FILTER_TABLE_SIZE - 1)
    index = min(int(position), FILTER_TABLE_SIZE - 2)
    a = load_f32(table, index)
    return a + (load_f32(table, index + 1) - a) * (position - index)


@inlined
def start_path(scene, camera, integrator, scratch, pixel, key, sample, x, y):
    """Reset the PATH record to one that the pixel (x, y) begins with, and return its first event.

    GOES_ON: with a camera ray. ARRIVES: on a surface that is baked. Or ENDS. Scene and camera, the tile's own, go to
    the path's time.
    """
    path = path_at(scratch + SCRATCH_PATH, 0)
    clear_record(path)
    path.pixel = pixel
    path.key = key
    path.sample = sample
    path.flags = RAY_CAMERA
    path.dimension = DIM_FIRST_VERTEX
    path.background_visible = 1
    path.receiver_set = SEES_ALL
    path.denoise = 1
    put(path.throughput, (1.0, 1.0, 1.0))
    put(path.feature_throughput, (1.0, 1.0, 1.0))
    path.min_pdf = FAR
    path.time = 0.5
    if scene.shutter != 0:
        path.time = shutter_time(shutter_at(scene.shutter, 0), camera, rng.sample1(key, sample, DIM_TIME), y)
        set_time(scene, camera, path.time)
    if camera.texels != 0:
        return ARRIVES if start_on_surface(scene, camera, integrator, scratch, path, x, y) else ENDS
    u, v = rng.sample2(key, sample, DIM_FILTER)
    if sample == 0 and integrator.first_centered != 0:
        u, v = 0.5, 0.5
    lens_u, lens_v = 0.0, 0.0
    if camera.aperture > 0.0:
        lens_u, lens_v = rng.sample2(key, sample, DIM_LENS)
    fx = x + 0.5 + filter_offset(integrator.filter_table, u)
    fy = y + 0.5 + filter_offset(integrator.filter_table, v)
    o, d, dp, dd = camera_ray(camera, fx, fy, lens_u, lens_v)
    put(path.o, o)
    put(path.d, d)
    path.dp = dp
    path.dd = dd
    return ENDS if is_black(d) else GOES_ON


@inlined
def ray_mask(flags):
    """The bits by which a path's ray looks for instances: diffuse and glossy mean reflection only."""
    bits = flags & RAY_ALL & ~(RAY_SHADOW | RAY_TRANSPARENT | RAY_SINGULAR)
    if bits & RAY_TRANSMIT:
        bits &= ~(RAY_DIFFUSE | RAY_GLOSSY)
    return bits


@inlined
def mis_weight(pdf, other):
    """Power heuristic."""
    a = pdf * pdf
    b = other * other
    return a / (a + b) if a + b > 0.0 else 0.0


@inlined
def hit_weight(path, light_pdf):
    """MIS weight of light found by the path's ray, which light sampling finds with density light_pdf."""
    if path.mis_pdf <= 0.0 or light_pdf <= 0.0:
        return 1.0
    return mis_weight(path.mis_pdf, light_pdf)


@inlined
def inherit(sp, path, t):
    """What a shading point knows of the path that arrives."""
    sp.ray_flags = path.flags | (RAY_LAST if path.last else 0)
    sp.depth = path.bounce
    sp.diffuse_depth = path.diffuse_bounce
    sp.glossy_depth = path.glossy_bounce
    sp.transmission_depth = path.transmission_bounce
    sp.transparent_depth = path.transparent_bounce
    sp.light = -1
    sp.receiver_set = path.receiver_set
    sp.time = path.time
    put(sp.receiver, vec(path.receiver))
    put(sp.light_shares, vec(path.light_shares))
    sp.dp = path.dp + t * path.dd
    sp.dd = path.dd


@inlined
def survival_probability(path, integrator):
    """Russian roulette: the probability to shade the surface. What it emits is counted in any case."""
    if path.flags & RAY_TRANSPARENT or path.bounce <= integrator.min_bounces:
        return 1.0
    w = path.throughput  # negative where a medium is denser than its majorant
    return min(1.0, math.sqrt(max3((abs(w[0]), abs(w[1]), abs(w[2])))))


@inlined
def roulette(integrator, path):
    """The weight of a path that survives Russian roulette at this vertex; 0: it does not."""
    survival = survival_probability(path, integrator)
    if not survival < 1.0:
        return 1.0
    if rng.sample1(path.key, path.sample, path.dimension + DIM_ROULETTE) >= survival:
        return 0.0
    return 1.0 / survival


@inlined
def next_after(t):
    """A distance behind the hit at t, for going on along the same ray."""
    return t * (1.0 + 1.0e-5) + 1.0e-12


@device
def pass_through(integrator, path, sp, weight):
    """Let the ray go on behind a transparent surface: GOES_ON, or ENDS where nothing gets through."""
    if max3(weight) <= 0.0:
        return ENDS
    put(path.throughput, mul(vec(path.throughput), weight))
    path.flags |= RAY_TRANSPARENT
    path.transparent_bounce += 1
    if path.transparent_bounce >= integrator.transparent_path:
        path.last = LAST_BEFORE_SURFACE
    path.dimension += DIMENSIONS
    path.tmin = next_after(sp.t)
    path.left = 0
    return GOES_ON


@inlined
def next_ray(path, sp, o, d):
    """Begin the path's next ray at the vertex sp, with how light sampling has chosen there: MIS asks for it again."""
    put(path.o, o)
    put(path.d, d)
    path.run_up = run_up(sp, d) if sp.instance >= 0 else 0.0
    path.left = sp.instance + 1 if path.run_up > 0.0 else 0
    path.receiver_set = sp.light_set
    put(path.receiver, vec(sp.receiver))
    put(path.light_shares, vec(sp.light_shares))
    path.tmin = 0.0
    path.dp = sp.dp


@inlined
def ray_flags(label):
    """RAY_* bits of the ray that leaves a surface by a lobe with this label."""
    flags = RAY_REFLECT if label & LABEL_REFLECT else RAY_TRANSMIT
    if label & LABEL_DIFFUSE:
        return flags | RAY_DIFFUSE
    if label & LABEL_GLOSSY:
        return flags | RAY_GLOSSY
    return flags | RAY_GLOSSY | RAY_SINGULAR


@inlined
def next_state(path, integrator, label, pdf):
    """Count the bounce, set the flags of the next ray, and note when it may only find light."""
    path.bounce += 1
    path.dimension += DIMENSIONS
    last = path.bounce >= integrator.max_bounces
    subsurface = RAY_SUBSURFACE_DIFFUSE | RAY_BURLEY_DIFFUSE
    kept = path.flags & subsurface  # as long as the path goes on, whatever it meets
    if label & LABEL_REFLECT:
        if label & LABEL_DIFFUSE:
            path.diffuse_bounce += 1
            last = last or path.diffuse_bounce >= integrator.diffuse_bounces
        else:
            path.glossy_bounce += 1
            last = last or path.glossy_bounce >= integrator.glossy_bounces
    else:
        path.transmission_bounce += 1
        last = last or path.transmission_bounce >= integrator.transmission_bounces
    if label & LABEL_DIFFUSE:
        kept |= integrator.after_diffuse & subsurface
    path.flags = ray_flags(label) | kept
    path.background_visible = 0
    path.mis_pdf = 0.0 if label & LABEL_SINGULAR else pdf
    if not label & LABEL_SINGULAR:
        path.min_pdf = min(path.min_pdf, pdf)
    if last:
        path.last = LAST
