"""DIFFUSION: light that enters anywhere on an object leaves by a profile of the distance alone.

Of the medium at the point that is seen the surface around only shares its shape; what lies between counts for nothing.
The integral over the surface is estimated by one probe (`probe`), whose every hit is an exit.
"""

import math

from ..core import rng
from ..core.jit import device, inlined, outcome_entry
from ..core.memory import load_i64
from ..core.records import closure_at, integrator_at, path_in, point_in, scene_at
from ..core.vec import dot, mul, vec
from ..lobes.closure import P_ANISOTROPY, P_BURLEY, P_LENGTH
from ..path.state import DIMENSIONS, FAR
from .albedo import similar, total_albedo
from .bssrdf import (
    BSSRDF_ALONE,
    CYCLES,
    EXITS,
    WHOLE,
    bssrdf_in,
    note_choice_of,
    probe_bssrdf,
    start_bssrdf,
    weigh_hits,
)
from .entry import enter
from .exits import amount, light_found
from .method_table import ALBEDOS, CYCLES_BURLEY, FLAGS
from .scales import channels, profile_scales

# Random dimensions of a probe's vertex: with the line the radius, with the channel the angle.
DIM_LINE, DIM_CHANNEL = 0, 1


@device
def _burley(c, throughput):
    """(weight, d), rgb each, of a closure that asks for BURLEY: the length is its own, and there is no entry."""
    d = (float(c.p[P_LENGTH]), float(c.p[P_LENGTH + 1]), float(c.p[P_LENGTH + 2]))
    return mul(throughput, (_is_length(d[0]), _is_length(d[1]), _is_length(d[2]))), d


@inlined
def _is_length(d):
    return 1.0 if 0.0 < d < math.inf else 0.0


@device
def _medium(c, table, throughput, mu):
    """(weight, d), rgb each, of a medium that light enters with the cosine mu: it returns what a half space does."""
    weight, sigma_t, alpha = channels(c, throughput)
    g = float(c.p[P_ANISOTROPY])
    d0, _, _ = profile_scales(sigma_t[0], alpha[0], g)
    d1, _, _ = profile_scales(sigma_t[1], alpha[1], g)
    d2, _, _ = profile_scales(sigma_t[2], alpha[2], g)
    a0 = total_albedo(table, similar(alpha[0], g), g, mu)
    a1 = total_albedo(table, similar(alpha[1], g), g, mu)
    a2 = total_albedo(table, similar(alpha[2], g), g, mu)
    return mul(weight, (a0, a1, a2)), (d0, d1, d2)


@device
def probed_exits(scene, integrator, scratch, wanted):
    """Fill the scratch's BSSRDF, and exits from one probe if `wanted`; how many, -1: no light enters.

    The exits' weights contain path.throughput.
    """
    scene, integrator, path, sp = scene_at(scene, 0), integrator_at(integrator, 0), path_in(scratch), point_in(scratch)
    n = vec(sp.ng)
    c = closure_at(sp.closures, sp.scatterer)
    table = integrator.scatter
    kind = WHOLE
    if c.p[P_BURLEY] != 0.0:
        path.dimension += DIMENSIONS
        weight, d = _burley(c, vec(path.throughput))
        if load_i64(table, FLAGS) & CYCLES_BURLEY != 0:
            kind = CYCLES
    else:
        enters, inwards = enter(path, sp, c)
        if not enters:
            return -1
        weight, d = _medium(c, load_i64(table, ALBEDOS), vec(path.throughput), -dot(inwards, n))
    if not amount(weight) > 0.0:
        return -1
    b = bssrdf_in(scratch)
    start_bssrdf(b, sp, kind, weight, d, d, FAR)
    found = 0
    if wanted != BSSRDF_ALONE:
        u_line, u_radius = rng.sample2(path.key, path.sample, path.dimension + DIM_LINE)
        u_channel, u_angle = rng.sample2(path.key, path.sample, path.dimension + DIM_CHANNEL)
        note_choice_of(b, u_line, u_channel)
        found = probe_bssrdf(scene, table, scratch, b, u_line, u_channel, u_radius, u_angle)
        weigh_hits(scratch, b, found, 1.0)
    path.dimension += DIMENSIONS
    return found


@outcome_entry
def diffusion(scene, integrator, film, scratch, _):
    """The method of kernels.subsurface.methods."""
    return light_found(scene, integrator, film, scratch, probed_exits(scene, integrator, scratch, EXITS))


@outcome_entry
def diffusion_exits(scene, integrator, film, scratch, wanted):
    """The method's exits, for who lights them himself (see kernels.subsurface.methods)."""
    return probed_exits(scene, integrator, scratch, wanted)
