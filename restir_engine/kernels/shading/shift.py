"""The points at which a bump's height is evaluated: the shading point and two others a footprint away."""

from ..core.jit import device
from ..core.vec import cross, dot, madd, normalize, scale, vec
from ..geometry.attributes import attribute


@device
def footprint_axes(sp):
    """The two axes of the ray's footprint on the surface, dp long, orthogonal to the geometric normal."""
    n = vec(sp.ng)
    if n[0] != n[1] or n[0] != n[2]:
        a = (n[2] - n[1], n[0] - n[2], n[1] - n[0])
    else:
        a = (n[2] - n[1], n[0] + n[2], -n[1] - n[0])
    a = normalize(a)
    return scale(a, sp.dp), scale(cross(n, a), sp.dp)


@device
def undisplaced_axes(scene, sp, name):
    """Those axes on the surface as it was before it was displaced, in object space; `name`: that of its places."""
    _found, x, y, z, _w = attribute(scene, sp, name, 0.0, 0.0)
    du, dv = barycentric_shift(sp, 1, 1.0)
    _found, ax, ay, az, _w = attribute(scene, sp, name, du, dv)
    du, dv = barycentric_shift(sp, 2, 1.0)
    _found, bx, by, bz, _w = attribute(scene, sp, name, du, dv)
    return (ax - x, ay - y, az - z), (bx - x, by - y, bz - z)


@device
def shifted_position(sp, offset, width):
    """sp.p, or for offset 1 and 2 a point `width` footprints away along an axis."""
    if offset == 0:
        return vec(sp.p)
    a, b = footprint_axes(sp)
    return madd(vec(sp.p), a if offset == 1 else b, width)


@device
def barycentric_shift(sp, offset, width):
    """(du, dv): how the barycentrics of that point differ from sp's."""
    if offset == 0:
        return 0.0, 0.0
    a, b = footprint_axes(sp)
    d = scale(a if offset == 1 else b, width)
    dpdu, dpdv = vec(sp.dpdu), vec(sp.dpdv)
    n = cross(dpdu, dpdv)
    area = dot(n, n)
    if area == 0.0:
        return 0.0, 0.0
    return dot(cross(d, dpdv), n) / area, dot(cross(dpdu, d), n) / area


@device
def shifted_attribute(scene, sp, name, offset, width):
    """`attribute` at that point."""
    du, dv = barycentric_shift(sp, offset, width)
    return attribute(scene, sp, name, du, dv)
