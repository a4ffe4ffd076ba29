"""Light that a path's ray finds by itself, weighed by MIS against light sampling: lamps, the world, surfaces."""

from ...kernels.core.jit import device, inlined
from ...kernels.core.records import instance_at, light_at
from ...kernels.core.vec import is_black, mul, scale, vec
from ...kernels.film.contribute import (
    BACKDROP,
    EMISSION,
    ENVIRONMENT,
    IN_WORLD,
    ON_SURFACE,
    add_world_behind,
    contribute,
    found,
    let_through,
    wants_backdrop,
)
from ...kernels.film.surface_passes import aov_passes, wants_aovs
from ...kernels.film.vectors import add_vector
from ...kernels.lights import light_radiance, lights_intersect, sun_next, triangle_pdf, world_pdf
from ...kernels.lights.emission import shadow_point, world_point
from ...kernels.lights.linking import EVERYTHING, reaches
from ...kernels.lights.world import world_radiance
from ...kernels.path.state import COUNTED, FAR, hit_weight, next_after
from ...kernels.volume.calls import through_media


@inlined
def add_lamps(scene, integrator, film, scratch, path, sp, t):
    """Add the lamps that the path's ray passes before the distance t; lamps do not block light."""
    if scene.n_lights == 0 or path.mis_pdf == COUNTED:
        return
    o = vec(path.o)
    d = vec(path.d)
    tmin = path.tmin
    for _ in range(scene.n_lights):
        light, distance = lights_intersect(scene, o, d, tmin, t, path.flags)
        if light < 0:
            return
        _add_lamp(scene, integrator, film, scratch, path, sp, light, distance)
        tmin = next_after(distance)


@inlined
def _found_by_ray(path, links, blockers):
    """Whether what a light sends along the path's ray is for the ray to find: see kernels.lights.linking."""
    return reaches(links, path.receiver_set) and (blockers == EVERYTHING or path.mis_pdf <= 0.0)


@device
def _add_lamp(scene, integrator, film, scratch, path, sp, light, distance):
    lamp = light_at(scene.lights, light)
    if not _found_by_ray(path, lamp.links, lamp.blockers):
        return
    r, g, b, pdf = light_radiance(scene, scratch, sp, light, vec(path.o), vec(path.d), distance)
    radiance = mul((r, g, b), through_media(scene, integrator, scratch, path, distance))
    _add_found(integrator, film, path, radiance, pdf, EMISSION, light, -1)


@device
def add_world(scene, integrator, film, scratch, path, sp):
    """Add suns and the world where the path leaves the scene, or note that it sees what is behind the picture."""
    d = vec(path.d)
    if path.background_visible > 0 and path.data_done == 0:
        add_vector(scene, film, path, 0)
    sun = sun_next(scene, d, 0, path.flags)
    while sun >= 0:
        _add_lamp(scene, integrator, film, scratch, path, sp, sun, FAR)
        sun = sun_next(scene, d, sun + 1, path.flags)
    kind = ENVIRONMENT
    if integrator.transparent_film > 0 and path.background_visible > 0:
        let_through(film, path, 1.0)
        if not wants_backdrop(film):
            return
        kind = BACKDROP
    if scene.world_material >= 0 and wants_aovs(film, path):
        point = shadow_point(scratch, sp)
        world_point(scene, point, d)
        aov_passes(scene, film, path, point)
    radiance = world_radiance(scene, scratch, sp, vec(path.o), d)
    if path.background_visible > 0:
        add_world_behind(film, path, radiance)
    pdf = world_pdf(scene, scratch, sp, vec(path.o), d) if path.mis_pdf > 0.0 else 0.0
    _add_found(integrator, film, path, radiance, pdf, kind, IN_WORLD, -1)


@inlined
def add_surface_emission(scene, integrator, film, path, sp, o):
    """Add what the surface at sp emits towards o, where the path's ray begins."""
    if is_black(vec(sp.emission)):
        return
    placed = instance_at(scene.instances, sp.instance)
    if _found_by_ray(path, placed.links, placed.blockers):
        pdf = triangle_pdf(scene, sp, o) if path.mis_pdf > 0.0 else 0.0
        _add_found(integrator, film, path, vec(sp.emission), pdf, EMISSION, ON_SURFACE, sp.instance)


@inlined
def _add_found(integrator, film, path, radiance, light_pdf, kind, source, instance):
    """Add radiance that the path's ray has found; light_pdf: with what density light sampling does, 0: it does not."""
    value = scale(mul(vec(path.throughput), radiance), hit_weight(path, light_pdf))
    contribute(integrator, film, path, value, found(path, kind, source, instance, light_pdf))
