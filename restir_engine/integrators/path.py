"""PATH, the reference: unidirectional path tracing with next event estimation and multiple importance sampling.

Behaviour follows Cycles where both have a choice: power heuristic, bounce limits by lobe class, transparency that
does not count as a bounce, Russian roulette by the square root of the throughput.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from ..context import FrameContext
from ..film import Film
from ..kernels.core import rng
from ..kernels.core.jit import device, inlined, kernel
from ..kernels.core.memory import address
from ..kernels.core.records import (
    INSTANCE_HOLDOUT,
    MATERIAL_EMITS,
    MATERIAL_MEDIUM,
    MATERIAL_TRANSPARENT,
    RAY_CAMERA,
    RAY_DIFFUSE,
    RAY_LAST,
    SCRATCH_CLOSURES,
    SCRATCH_PATH,
    SCRATCH_POINT,
    SCRATCH_REGISTERS,
    instance_at,
    material_at,
    path_at,
    shading_point_at,
)
from ..kernels.core.vec import average, max3, mul, normalize, put, scale, vec
from ..kernels.film.contribute import add1, add3, add_hit
from ..kernels.film.surface_passes import data_passes, feature_passes
from ..kernels.geometry.camera import camera_reach
from ..kernels.geometry.intersect import nearest, trace
from ..kernels.geometry.surface import offset_origin, surface_point
from ..kernels.lights import light_radiance, lights_intersect, sun_next, triangle_pdf
from ..kernels.lights.world import world_pdf, world_radiance
from ..kernels.lobes import LABEL_SUBSURFACE, LABEL_TRANSPARENT, bsdf_blur, bsdf_sample
from ..kernels.path.direct import direct_light, direct_lights, lobe_sum
from ..kernels.path.state import (
    COUNTED,
    DIM_DIRECTION,
    DIM_LOBE,
    DIM_ROULETTE,
    FAR,
    LAST,
    LAST_BEFORE_SURFACE,
    LEAVES,
    LIT,
    hit_weight,
    inherit,
    next_after,
    next_state,
    pass_through,
    share,
    start_path,
    survival_probability,
    visibility,
)
from ..kernels.shading.interpreter import shader_eval
from ..kernels.subsurface.methods import scatter
from ..kernels.volume.calls import ENDED, PASSES, pass_boundary, pass_media, start_segment, through_media
from ..settings import RenderSettings
from .base import Integrator, Stage, Tile

# What comes next of a path: its end; its new ray, or what that has hit; a way through a medium; light where it stands.
ENDS, GOES_ON, ARRIVES, SCATTERS, SHADES = 0, 1, 2, 3, 4


@kernel
def render_tile(scene, camera, integrator, film, scratch, x0, y0, x1, y1, first_sample, samples):
    """Add `samples` samples to each pixel of a tile; returns the number of paths."""
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = film.pixels + 4 * film.channels * (y * film.width + x)
            key = rng.key(integrator.seed, x, y, 0)
            for sample in range(first_sample, first_sample + samples):
                start_path(camera, integrator, scratch, pixel, key, sample, x, y)
                trace_path(scene, camera, integrator, film, scratch, GOES_ON, 1)
    return (x1 - x0) * (y1 - y0) * samples


@inlined
def trace_path(scene, camera, integrator, film, scratch, step, exit_lights):
    """Follow the path in scratch until it leaves the scene, is absorbed, or may not go on.

    `step` is what comes next: GOES_ON with its ray, ARRIVES with the hit in scratch, SHADES or SCATTERS at its shading
    point. exit_lights: light samples where light leaves the first object below whose surface it is scattered.
    """
    path = path_at(scratch + SCRATCH_PATH, 0)
    sp = tile_point(scratch)
    while step != ENDS:
        if step == GOES_ON:
            trace_ray(scene, camera, scratch, path)
            step = ARRIVES
        if step == ARRIVES:
            step = arrive(scene, camera, integrator, film, scratch, path, sp)
            path.scattered = 0
        if step == SHADES:
            if path.scattered == LEAVES and path.bounce == 0:
                direct_lights(scene, integrator, film, scratch, path, sp, exit_lights)
            elif path.scattered != LIT:
                direct_light(scene, integrator, film, scratch, path, sp)
            step = bounce(scene, integrator, path, sp)
        if step == SCATTERS:
            step = SHADES if scatter(scene, integrator, film, scratch, path, sp) else ENDS


@inlined
def tile_point(scratch):
    """The SHADING_POINT of the path in a tile's working memory, with room for its closures."""
    sp = shading_point_at(scratch + SCRATCH_POINT, 0)
    sp.closures = scratch + SCRATCH_CLOSURES
    sp.registers = scratch + SCRATCH_REGISTERS
    return sp


@inlined
def trace_ray(scene, camera, scratch, path):
    """Trace the path's ray, for `arrive`."""
    d = vec(path.d)
    reach = camera_reach(camera, d) if path.flags & RAY_CAMERA else FAR
    trace(scene, scratch, vec(path.o), d, path.tmin, reach, visibility(path.flags))


@inlined
def arrive(scene, camera, integrator, film, scratch, path, sp):
    """Add the light that the path's ray finds: ENDS, GOES_ON behind a surface, or SHADES: sp is ready.

    The ray's hit is in scratch; sp is still the surface that the ray leaves, except for a camera ray.
    """
    t, instance, primitive, u, v = nearest(scratch)
    start_segment(scene, integrator, scratch, path, sp)
    o = vec(path.o)
    d = vec(path.d)
    inherit(sp, path, t)
    if path.flags & RAY_DIFFUSE:
        sp.ray_flags |= integrator.after_diffuse
    if scene.n_lights > 0 and path.mis_pdf != COUNTED:
        add_lamps(scene, integrator, film, scratch, path, sp, t)
    event = pass_media(scene, integrator, film, scratch, path, t, instance)
    if event != PASSES:
        return ENDS if event == ENDED else GOES_ON
    if instance < 0:
        add_world(scene, integrator, film, scratch, path, sp)
        return ENDS
    if path.last == LAST_BEFORE_SURFACE:
        return ENDS
    surface_point(scene, sp, instance, primitive, u, v, t, d)
    material = material_at(scene.materials, sp.material).flags
    if material & MATERIAL_MEDIUM and pass_boundary(scene, scratch, path, sp):
        return GOES_ON
    survival = survival_probability(path, integrator)
    ends = survival < 1.0 and rng.sample1(path.key, path.sample, path.dimension + DIM_ROULETTE) >= survival
    if ends:
        sp.ray_flags |= RAY_LAST
    if sp.ray_flags & RAY_LAST and not material & (MATERIAL_EMITS | MATERIAL_TRANSPARENT):
        return ENDS
    shader_eval(scene, sp)
    if integrator.filter_glossy < FAR and path.min_pdf < FAR:
        blur = integrator.filter_glossy * path.min_pdf
        if blur < 1.0:
            bsdf_blur(sp, 0.5 * math.sqrt(1.0 - blur))
    if holdout(scene, film, path, sp):
        return ENDS
    if sp.emission[0] != 0.0 or sp.emission[1] != 0.0 or sp.emission[2] != 0.0:
        pdf = 0.0
        if path.mis_pdf > 0.0:
            pdf = triangle_pdf(scene, sp, o)
        add_hit(film, integrator, path, vec(sp.emission), hit_weight(path, pdf), film.emission)
    if ends:
        return ENDS
    if survival < 1.0:
        put(path.throughput, scale(vec(path.throughput), 1.0 / survival))
    if film.data_passes > 0 and path.background_visible > 0:
        data_passes(scene, camera, integrator, film, path, sp)
    if film.denoising_albedo >= 0 and path.denoise > 0:
        feature_passes(scene, camera, film, path, sp)
    if path.last:
        return GOES_ON if pass_through(path, sp, integrator, vec(sp.transparent)) else ENDS
    return SHADES


@inlined
def holdout(scene, film, path, sp):
    """Punch a holdout's share out of the alpha channel; True when nothing of the surface is left."""
    h = sp.holdout
    if instance_at(scene.instances, sp.instance).flags & INSTANCE_HOLDOUT:
        t = average(vec(sp.transparent))
        h = 1.0 - t
    if h <= 0.0 or path.background_visible == 0:
        return False
    add1(path.pixel, film.combined + 3, h * average(vec(path.throughput)))
    if h >= 1.0 - 1.0e-6:
        return True
    if instance_at(scene.instances, sp.instance).flags & INSTANCE_HOLDOUT:
        sp.n_closures = 0
        put(sp.emission, (0.0, 0.0, 0.0))
        path.last = LAST
    return False


@inlined
def add_lamps(scene, integrator, film, scratch, path, sp, t):
    """Light of the lamps that the path's ray passes before the distance t; lamps do not block light."""
    o = vec(path.o)
    d = vec(path.d)
    tmin = path.tmin
    for _ in range(scene.n_lights):
        light, distance = lights_intersect(scene, o, d, tmin, t, path.flags)
        if light < 0:
            return
        add_lamp(scene, integrator, film, scratch, path, sp, light, distance)
        tmin = next_after(distance)


@device
def add_lamp(scene, integrator, film, scratch, path, sp, light, distance):
    r, g, b, pdf = light_radiance(scene, scratch, sp, light, vec(path.o), vec(path.d), distance)
    r, g, b = mul((r, g, b), through_media(scene, scratch, path, distance))
    add_hit(film, integrator, path, (r, g, b), hit_weight(path, pdf), film.emission)


@device
def add_world(scene, integrator, film, scratch, path, sp):
    """Light of suns and of the world where the path leaves the scene, and the alpha channel behind it."""
    d = vec(path.d)
    sun = sun_next(scene, d, 0, path.flags)
    while sun >= 0:
        add_lamp(scene, integrator, film, scratch, path, sp, sun, FAR)
        sun = sun_next(scene, d, sun + 1, path.flags)
    seen_through = integrator.transparent_film > 0 and path.background_visible > 0
    if seen_through:
        add1(path.pixel, film.combined + 3, average(vec(path.throughput)))
        if film.environment < 0:
            return
    r, g, b = world_radiance(scene, scratch, sp, vec(path.o), d)
    if seen_through:
        add3(path.pixel, film.environment, mul(vec(path.throughput), (r, g, b)))
        return
    mis = 1.0
    if path.mis_pdf > 0.0:
        mis = hit_weight(path, world_pdf(scene, d))
    add_hit(film, integrator, path, (r, g, b), mis, film.environment)


@inlined
def bounce(scene, integrator, path, sp):
    """Sample the lobes and make the path's next ray: ENDS, GOES_ON or SCATTERS."""
    if sp.n_closures == 0:
        return ENDS
    u0 = rng.sample1(path.key, path.sample, path.dimension + DIM_LOBE)
    u1, u2 = rng.sample2(path.key, path.sample, path.dimension + DIM_DIRECTION)
    label, wi, f, pdf = bsdf_sample(scene, sp, u0, u1, u2)
    if label == 0 or pdf <= 0.0:
        return ENDS
    total = lobe_sum(f)
    if max3(total) <= 0.0:
        return ENDS
    if label & LABEL_TRANSPARENT:
        return GOES_ON if pass_through(path, sp, integrator, scale(total, 1.0 / pdf)) else ENDS
    put(path.throughput, scale(mul(vec(path.throughput), total), 1.0 / pdf))
    if path.bounce == 0:
        put(path.diffuse_weight, (share(f[0], total[0]), share(f[1], total[1]), share(f[2], total[2])))
        put(path.glossy_weight, (share(f[3], total[0]), share(f[4], total[1]), share(f[5], total[2])))
    if label & LABEL_SUBSURFACE:
        return SCATTERS
    put(path.o, offset_origin(sp, wi))
    put(path.d, normalize(wi))
    put(path.receiver, vec(sp.receiver))
    path.tmin = 0.0
    path.dp = sp.dp
    next_state(path, integrator, label, pdf)
    return GOES_ON


class PathIntegrator(Integrator):
    """The PATH kernel with a scene, settings and a film."""

    def __init__(
        self, context: FrameContext, settings: RenderSettings, film: Film, history: object | None = None
    ) -> None:
        super().__init__(context, settings, film, history)
        self._render((0, 0, 0, 0), self.scratch(), 0, 0)  # compiles, or loads from the cache

    def stages(self, first_sample: int, samples: int) -> list[Stage]:
        """One: all samples of a tile at once."""
        return [Stage(partial(self._render, first_sample=first_sample, samples=samples), finish=self.end_batch)]

    def _render(self, tile: Tile, scratch: np.ndarray, first_sample: int, samples: int) -> None:
        context = self.context
        args = (context.record, context.camera_record, self.record[0], self.film.record, address(scratch))
        render_tile(*args, *tile, first_sample, samples)
