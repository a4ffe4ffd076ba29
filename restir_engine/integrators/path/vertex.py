"""What a path's ray meets, in the order of its way: lamps, a medium, then a surface or the world."""

from ...kernels.core.jit import inlined
from ...kernels.core.records import RAY_DIFFUSE
from ...kernels.geometry.intersect import nearest
from ...kernels.path.state import ARRIVES, ENDS, inherit
from ...kernels.volume.calls import pass_media, start_segment
from .emission import add_lamps, add_world
from .surface import meet_surface


@inlined
def arrive(scene, camera, integrator, film, scratch, path, sp):
    """Follow the path along its ray to what that has hit, and return its next event.

    SHADES: sp is a surface that scatters. GOES_ON: the path has its next ray, behind the surface or from a medium.
    ENDS. The hit is in scratch; sp is still the surface that the ray leaves, except for a camera ray.
    """
    t, instance, primitive, u, v = nearest(scratch)
    start_segment(scene, integrator, scratch, path, sp)
    inherit(sp, path, t)
    if path.flags & RAY_DIFFUSE:
        sp.ray_flags |= integrator.after_diffuse
    add_lamps(scene, integrator, film, scratch, path, sp, t)
    event = pass_media(scene, integrator, film, scratch, path, t, instance)
    if event != ARRIVES:
        return event
    if instance < 0:
        add_world(scene, integrator, film, scratch, path, sp)
        return ENDS
    return meet_surface(scene, integrator, film, scratch, path, sp, t, instance, primitive, u, v)
