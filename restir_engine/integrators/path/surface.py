"""What happens where a path meets a surface: emission, holdouts, roulette, and the closures of its next bounce."""

import math

from ...kernels.core.jit import inlined
from ...kernels.core.records import (
    INSTANCE_HOLDOUT,
    MATERIAL_EMITS,
    MATERIAL_MEDIUM,
    MATERIAL_TRANSPARENT,
    RAY_LAST,
    instance_at,
    material_at,
)
from ...kernels.core.vec import average, put, scale, vec
from ...kernels.film.contribute import let_through
from ...kernels.film.surface_passes import aov_passes, surface_passes
from ...kernels.geometry.surface import surface_point
from ...kernels.lobes import bsdf_blur
from ...kernels.path.state import ENDS, FAR, GOES_ON, LAST, LAST_BEFORE_SURFACE, roulette
from ...kernels.shading.interpreter import shader_eval
from ...kernels.volume.calls import pass_boundary
from .caught import light_or_leave, meet_catcher
from .emission import add_surface_emission


@inlined
def meet_surface(scene, integrator, film, scratch, path, sp, t, instance, primitive, u, v):
    """Shade the surface that the path's ray has hit, and return the path's next event: see `vertex.arrive`.

    Roulette comes before shading: a path that ends here still counts what the surface emits, but needs no closures.
    """
    if path.last == LAST_BEFORE_SURFACE:
        return ENDS
    surface_point(scene, sp, instance, primitive, u, v, t, vec(path.d))
    sp.touches = 1 if path.left > 0 and t == 0.0 else 0
    material = material_at(scene.materials, sp.material).flags
    if material & MATERIAL_MEDIUM and pass_boundary(scene, scratch, path, sp):
        return GOES_ON
    meet_catcher(scene, film, scratch, path, sp)
    weight = roulette(integrator, path)
    if weight == 0.0:
        sp.ray_flags |= RAY_LAST
    if sp.ray_flags & RAY_LAST and not material & (MATERIAL_EMITS | MATERIAL_TRANSPARENT):
        return ENDS
    aov_passes(scene, film, path, sp)
    shade(scene, integrator, path, sp)
    if _holdout(scene, film, path, sp):
        return ENDS
    add_surface_emission(scene, integrator, film, path, sp, vec(path.o))
    if weight == 0.0:
        return ENDS
    put(path.throughput, scale(vec(path.throughput), weight))
    surface_passes(scene, integrator, film, scratch, path, sp)
    return light_or_leave(integrator, film, path, sp)


@inlined
def shade(scene, integrator, path, sp):
    """Run the surface's program at sp; filter glossy: no lobe is sharper than what the path has been through."""
    shader_eval(scene, sp)
    if integrator.filter_glossy < FAR and path.min_pdf < FAR:
        blur = integrator.filter_glossy * path.min_pdf
        if blur < 1.0:
            bsdf_blur(sp, 0.5 * math.sqrt(1.0 - blur))


@inlined
def _holdout(scene, film, path, sp):
    """Let the holdout's share see what is behind the picture; True when nothing of the surface is left."""
    whole = instance_at(scene.instances, sp.instance).flags & INSTANCE_HOLDOUT != 0
    h = 1.0 - average(vec(sp.transparent)) if whole else sp.holdout
    if h <= 0.0 or path.background_visible == 0:
        return False
    let_through(film, path, h)
    if h >= 1.0 - 1.0e-6:
        return True
    if whole:
        sp.n_closures = 0
        put(sp.emission, (0.0, 0.0, 0.0))
        path.last = LAST
    return False
