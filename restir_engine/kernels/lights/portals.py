"""Portals: areas without light of their own, which show where the world shines into a room.

They are LIGHT records of area lamps, and directions are drawn through them as points are drawn on those: a portal by
about what the world sends through it, then a direction by solid angle or by area. Others go by the world's map, so
that light is right, if noisier, where it comes in without a portal.
"""

from ..core.jit import device
from ..core.records import light_at
from ..core.vec import vec
from ..core.warp import stream_choice
from .area import area_pdf, intersect_area, sample_area
from .select import importance
from .world import draw_world, world_density

_ANYWHERE = (0.0, 0.0, 0.0)  # no normal


@device
def portals_bring(table, o):
    """About the irradiance of what the world sends through all portals that face o; 0: none does."""
    total = 0.0
    for i in range(table.n_portals):
        total += importance(light_at(table.portals, i), o, _ANYWHERE)
    return total


@device
def _density(table, o, d, drawn, pdf):
    """Density by solid angle of d among directions through portals; pdf: that through `drawn`, if that is 0 or more."""
    total = 0.0
    weighed = 0.0
    for i in range(table.n_portals):
        portal = light_at(table.portals, i)
        w = importance(portal, o, _ANYWHERE)
        total += w
        if i == drawn:
            weighed += w * pdf
        elif w > 0.0:
            t = intersect_area(portal, o, d)
            if t > 0.0:
                weighed += w * area_pdf(portal, o, d, t)
    return weighed / total if total > 0.0 else -1.0


@device
def _mixed(table, d, through):
    """The density of d by portals and map; through: that by portals, negative where none faces the point."""
    if through < 0.0:
        return world_density(table, d)
    return table.portal * through + (1.0 - table.portal) * world_density(table, d)


@device
def density_with_portals(table, o, d):
    """The density by solid angle with which `draw_with_portals` chooses d for o."""
    return _mixed(table, d, _density(table, o, d, -1, 0.0))


@device
def draw_with_portals(table, o, u0, u1, u2, ls):
    """(a direction of the world for o, its density by solid angle); density 0: none. Uses ls."""
    chosen = -1
    if u2 < table.portal:
        u = u2 / table.portal
        total = 0.0
        for i in range(table.n_portals):
            w = importance(light_at(table.portals, i), o, _ANYWHERE)
            if w > 0.0:
                total += w
                taken, u = stream_choice(u, w / total)
                if taken:
                    chosen = i
        u2 = u
    else:
        u2 = (u2 - table.portal) / (1.0 - table.portal)
    if chosen >= 0:
        if sample_area(light_at(table.portals, chosen), o, u0, u1, ls) <= 0.0:
            return vec(ls.wi), 0.0
        d = vec(ls.wi)
        return d, _mixed(table, d, _density(table, o, d, chosen, float(ls.pdf)))
    if table.map + table.sun <= 0.0:
        return _ANYWHERE, 0.0
    d, _ = draw_world(table, u0, u1, u2)
    return d, density_with_portals(table, o, d)
