"""A path's first vertex that is lit: behind it begins what pixels share."""

from ...kernels.core.jit import device, inlined
from ...kernels.core.records import closure_at
from ...kernels.lobes import bsdf_has_eval
from ...kernels.lobes.closure import LOBE_SUBSURFACE
from ...kernels.path.state import ENDS, GOES_ON, SHADES
from .bounce import bounce
from .trace import trace_ray
from .vertex import arrive


@device
def scatters_below(sp):
    """Whether light scatters below sp."""
    scatters = False
    for i in range(sp.n_closures):
        scatters = scatters or closure_at(sp.closures, i).kind == LOBE_SUBSURFACE
    return scatters


@inlined
def first_vertex(scene, camera, integrator, film, scratch, path, sp, event):
    """Follow the path, whose first event this is, to where light sampling is of use, or light scatters below.

    False where it ends before.
    """
    if event == ENDS:
        return False
    while True:
        if event == GOES_ON:
            trace_ray(scene, camera, scratch, path)
        event = arrive(scene, camera, integrator, film, scratch, path, sp)
        if event == SHADES:
            if scatters_below(sp) or bsdf_has_eval(sp):
                return True
            event = bounce(scene, integrator, path, sp)
        if event == ENDS:
            return False
