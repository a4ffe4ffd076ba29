"""How light that crosses straight reaches the film, and how paths go on where it has been lit."""

from ....kernels.core.jit import entry, outcome_entry
from ....kernels.core.memory import load_f64, store_f64
from ....kernels.core.records import closure_at, film_at, integrator_at, path_in, point_in, scene_at
from ....kernels.lights import light_is_sampled
from ....kernels.path.state import COUNTED, ENDS, GOES_ON, LIT
from ....kernels.subsurface.bssrdf import EXITS
from ....kernels.subsurface.exits import exit_amounts, exit_at, exit_events, leave_by_one, light_one
from ....kernels.subsurface.hybrid import traced_exits
from ....kernels.subsurface.probe import H_LIT
from ...path.bounce import bounce
from ..subsurface.shade import add_from_below
from .closures import is_served

_EVENTS = 0


@entry
def add_crossing(integrator, film, frame, scratch, pixel):
    """Add what candidates or reuse have left as a pixel's light that crosses straight; `frame` is the companion."""
    add_from_below(integrator, film, frame, scratch, pixel, _EVENTS)


@outcome_entry
def hybrid_but_crossing(scene, integrator, film, scratch, _):
    """HYBRID where the boundary's exit is lit by `add_crossing` (see kernels.subsurface.methods)."""
    n = traced_exits(scene, integrator, scratch, EXITS)
    total, most = exit_amounts(scratch, n)
    if n <= 0 or not 0.0 < total < 1.0e30:
        return ENDS
    scene, integrator, film = scene_at(scene, 0), integrator_at(integrator, 0), film_at(film, 0)
    path, sp = path_in(scratch), point_in(scratch)
    served = is_served(closure_at(sp.closures, sp.scatterer))
    for k in range(n):
        store_f64(exit_at(scratch, k), H_LIT, 1.0 if served and exit_events(scratch, k) == _EVENTS else 0.0)
    at = -1
    if light_is_sampled(scene):
        at = light_one(scene, integrator, film, scratch, path, sp, n, most, True, False)
    chosen = leave_by_one(scene, scratch, path, sp, n, total, at)
    if load_f64(exit_at(scratch, chosen), H_LIT) == 0.0:
        return LIT
    event = bounce(scene, integrator, path, sp)
    if event == GOES_ON and path.mis_pdf > 0.0:
        path.mis_pdf = COUNTED
    return event
