"""Cells of an emissive triangle whose light varies over it: light samples choose among them by what they emit.

With s cells along each edge, row i (barycentrics u from i / s to (i + 1) / s) holds 2 (s - i) - 1 of the s² cells: by
turns one that is the triangle itself made smaller by s, and one that is turned by half a turn as well. They are counted
row by row: i (2 s - i) come before row i.
"""

import math

from ..core.jit import inlined
from ..core.vec import madd, scale


@inlined
def cell_at(s, u, v):
    """The number of the cell that a point with barycentrics (u, v) lies in."""
    if s == 1:
        return 0
    i = min(int(u * s), s - 1)
    j = min(int(v * s), s - 1 - i)
    turned = i + j < s - 1 and u * s - i + v * s - j > 1.0
    return i * (2 * s - i) + 2 * j + (1 if turned else 0)


@inlined
def cell(s, index):
    """(u, v, side) of a cell: a corner, and the share of the triangle's edges that its own are, negative if turned."""
    if s == 1:
        return 0.0, 0.0, 1.0
    i = int(s - math.sqrt(s * s - index))
    rest = index - i * (2 * s - i)
    turned = rest & 1
    return (i + turned) / s, ((rest >> 1) + turned) / s, (-1.0 if turned else 1.0) / s


@inlined
def cell_of_triangle(a, ab, ac, s, index):
    """(corner, edge, edge) of a cell of the triangle with a corner a and the edges ab and ac."""
    u, v, side = cell(s, index)
    return madd(madd(a, ab, u), ac, v), scale(ab, side), scale(ac, side)
