"""Which kind of light: lamps, emissive triangles or the world, by about what each brings to the point that is lit.

What they bring is an irradiance as if nothing were in their way: of lamps and triangles by `select` and
`emitter_tree`, of the world by the quadratic polynomial in the normal that it is nearly (Ramamoorthi and Hanrahan
2001). Part of the choice goes by its root, since what is bright may be hidden.
"""

import math

from ..core.jit import device, inlined
from ..core.records import closure_at, light_table_at, world_table_at
from ..core.vec import put, vec
from ..lobes.closure import LOBE_GLASS, LOBE_REFRACTION, LOBE_TRANSLUCENT, is_fibre
from .emitter_tree import triangles_bring
from .portals import portals_bring
from .select import lamps_bring

_FLAT = 0.3  # the part that goes by the root


@device
def world_brings(table, o, n):
    """About the irradiance of the world on a surface at o with normal n (zero: over all directions).

    Where portals face o it comes through these alone.
    """
    through = portals_bring(table, o) if table.n_portals > 0 else 0.0
    if through > 0.0:
        return through
    c = table.irradiance
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return 4.0 * c[0]
    x, y, z = n
    e = c[0] + c[1] * y + c[2] * z + c[3] * x + c[4] * x * y + c[5] * y * z + c[6] * (3.0 * z * z - 1.0)
    e += c[7] * x * z + c[8] * (x * x - y * y)
    return max(e, 0.1 * c[0])


@inlined
def _receiver(sp):
    """The normal that lights are weighed by: none where light passes through the surface, or in a medium."""
    for i in range(sp.n_closures):
        kind = closure_at(sp.closures, i).kind
        if kind == LOBE_TRANSLUCENT or LOBE_REFRACTION <= kind <= LOBE_GLASS or is_fibre(kind):
            return (0.0, 0.0, 0.0)
    return vec(sp.n)


@inlined
def share_out(lamps, triangles, world):
    """Probabilities in proportion to what the kinds bring, and in part to its root; all 0 where nothing comes."""
    total = lamps + triangles + world
    if not total > 0.0:
        return (0.0, 0.0, 0.0)
    a, b, c = math.sqrt(lamps), math.sqrt(triangles), math.sqrt(world)
    s, r = (1.0 - _FLAT) / total, _FLAT / (a + b + c)
    return (s * lamps + r * a, s * triangles + r * b, s * world + r * c)


@device
def note_choice(scene, sp):
    """Note in sp how light sampling chooses there: the normal `receiver` and the shares of the kinds of light."""
    put(sp.receiver, (0.0, 0.0, 0.0))
    put(sp.light_shares, (0.0, 0.0, 0.0))
    if scene.light_table == 0:
        return
    table = light_table_at(scene.light_table, 0)
    n = _receiver(sp)
    put(sp.receiver, n)
    sp.receiver_set = sp.light_set
    alone = max(table.lamps, max(table.triangles, table.world))
    if alone == 1.0:
        put(sp.light_shares, (float(table.lamps), float(table.triangles), float(table.world)))
        return
    o = vec(sp.p)
    lamps = lamps_bring(scene, table, o, n, sp.light_set) if table.lamps > 0.0 else 0.0
    triangles = triangles_bring(table, o, n) if table.triangles > 0.0 else 0.0
    world = world_brings(world_table_at(scene.world_table, 0), o, n) if table.world > 0.0 else 0.0
    put(sp.light_shares, share_out(lamps, triangles, world))
