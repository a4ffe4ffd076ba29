"""Emissive triangles: chosen by power, then a point uniform by solid angle where they are near, by area where not.

Where emission varies over a triangle, the point is one of a cell of it, chosen by its emission.
"""

import math

from ..core.jit import device, inlined
from ..core.memory import load_f32, load_i32
from ..core.records import (
    LIGHT_SAMPLE_DELTA,
    MATERIAL_VARYING_EMISSION,
    emitter_at,
    emitter_group_at,
    instance_at,
    light_table_at,
    light_tiles_at,
    material_at,
    mesh_at,
)
from ..core.vec import add, cross, dot, length, madd, normalize, put, scale, sub, transform_point, vec
from ..geometry.placed import corners, placed_at
from ..geometry.surface import primitive_material, surface_point
from .cells import cell, cell_at, cell_of_triangle
from .emission import run_emission, shadow_point
from .emitter_tree import cell_share, choose_triangle, triangle_share
from .linking import EVERYTHING, reaches

# Emission sampling of materials; 1 (auto) and 4 mean both sides.
_FRONT = 2
_BACK = 3

# Of the points of a triangle with cells those that are drawn from all of it, where it is nearer than it is long.
_WHOLE = 0.5

# Below this solid angle the spherical formulas lose their digits, and area sampling is as good.
_TINY = 1e-7


@device
def triangle_vertices(scene, instance, primitive):
    """The corners of a triangle in world space."""
    placed = placed_at(scene, instance)
    a, b, c = corners(mesh_at(scene.meshes, placed.mesh), scene.time, primitive)
    m = placed.to_world
    return transform_point(m, a), transform_point(m, b), transform_point(m, c)


@device
def _spherical(a, b, c, n, o):
    """Solid angle of the triangle (a, b, c) with normal n (any length) from o; 0 where it is to be sampled by area."""
    e = sub(b, a)
    f = sub(c, a)
    g = sub(c, b)
    longest2 = max(dot(e, e), max(dot(f, f), dot(g, g)))
    h = dot(n, sub(a, o))
    if longest2 * dot(n, n) <= h * h:
        return 0.0
    a = normalize(sub(a, o))
    b = normalize(sub(b, o))
    c = normalize(sub(c, o))
    solid_angle = 2.0 * math.atan2(abs(dot(a, cross(b, c))), 1.0 + dot(a, b) + dot(b, c) + dot(c, a))
    return solid_angle if solid_angle > _TINY else 0.0


@device
def _spherical_direction(a, b, c, solid_angle, s, t):
    """A direction of the spherical triangle of the unit vectors a, b, c, uniform by solid angle (Arvo 1995)."""
    cos_b = dot(a, c)
    cos_c = dot(a, b)
    cos_alpha = min(max(dot(normalize(cross(a, b)), normalize(cross(a, c))), -1.0), 1.0)
    sin_alpha = math.sqrt(1.0 - cos_alpha * cos_alpha)
    phi = s * solid_angle - math.acos(cos_alpha)
    sin_phi = math.sin(phi)
    cos_phi = math.cos(phi)
    u = cos_phi - cos_alpha
    v = sin_phi + sin_alpha * cos_c
    below = (v * sin_phi + u * cos_phi) * sin_alpha
    q = ((v * cos_phi - u * sin_phi) * cos_alpha - v) / below if below != 0.0 else 1.0
    q = min(max(q, -1.0), 1.0)
    d = madd(scale(a, q), normalize(madd(c, a, -cos_b)), math.sqrt(1.0 - q * q))
    z = 1.0 - t * (1.0 - dot(d, b))
    return madd(scale(b, z), normalize(madd(d, b, -dot(d, b))), math.sqrt(max(1.0 - z * z, 0.0)))


@device
def _sampled_side(scene, point):
    """Whether next event estimation samples the side of the emissive triangle that `point` shows."""
    side = material_at(scene.materials, point.material).emission_sampling
    return not ((side == _FRONT and point.backfacing) or (side == _BACK and not point.backfacing))


@device
def even_barycentrics(u0, u1):
    """Barycentrics uniform by area: Heitz's map of the square, which keeps neighbours together."""
    if u1 > u0:
        return 0.5 * u0, u1 - 0.5 * u0
    return u0 - 0.5 * u1, 0.5 * u1


@device
def sample_triangle(scene, sp, scratch, o, u0, u1, u2, ls):
    """Choose a point of an emissive triangle; ls.pdf leaves out the choice between lamps, triangles and world."""
    table = light_table_at(scene.light_table, 0)
    index, i, part, chance = choose_triangle(table, o, vec(sp.receiver), u2)
    if chance <= 0.0:
        return False
    emitter = emitter_at(table.emitters, index)
    group = emitter_group_at(table.groups, emitter.group)
    primitive = load_i32(group.primitives, i)
    instance = emitter.instance
    a, b, c = triangle_vertices(scene, instance, primitive)
    ab, ac = sub(b, a), sub(c, a)
    first, second, side = 0.0, 0.0, 1.0
    if group.cells > 1:
        whole = _WHOLE if _spherical(a, b, c, cross(ab, ac), o) > 0.0 else 0.0
        if u0 < whole:
            u0 /= whole
        else:
            u0 = (u0 - whole) / (1.0 - whole)
            first, second, side = cell(group.cells, part)
    corner = madd(madd(a, ab, first), ac, second)
    found, u, v, p, d, t, density = _sample_part(o, u0, u1, corner, scale(ab, side), scale(ac, side))
    if not found:
        return False
    u, v = first + side * u, second + side * v
    if group.cells > 1:
        density = _density_with_cells(group, i, o, a, ab, ac, u, v, p)
    ls.pdf = density * chance
    return ls.pdf > 0.0 and _complete(scene, sp, scratch, instance, primitive, u, v, p, d, t, ls, True)


@device
def _sample_part(o, u0, u1, a, ab, ac):
    """(whether there is one, barycentrics u and v, the point, direction, distance, density): a point of a triangle."""
    nowhere = (0.0, 0.0, 0.0)
    b, c = add(a, ab), add(a, ac)
    n = cross(ab, ac)
    size = length(n)
    if size == 0.0:
        return False, 0.0, 0.0, nowhere, nowhere, 0.0, 0.0
    solid_angle = _spherical(a, b, c, n, o)
    if solid_angle > 0.0:
        d = _spherical_direction(normalize(sub(a, o)), normalize(sub(b, o)), normalize(sub(c, o)), solid_angle, u0, u1)
        along = dot(d, n)
        if along == 0.0:
            return False, 0.0, 0.0, nowhere, nowhere, 0.0, 0.0
        t = dot(sub(a, o), n) / along
        p = madd(o, d, t)
        w = sub(p, a)
        inverse = 1.0 / (size * size)
        u = min(max(dot(cross(w, ac), n) * inverse, 0.0), 1.0)
        v = min(max(dot(cross(ab, w), n) * inverse, 0.0), 1.0 - u)
        return True, u, v, p, d, t, 1.0 / solid_angle
    u, v = even_barycentrics(u0, u1)
    p = madd(madd(a, ab, u), ac, v)
    d, t2 = _towards(p, o)
    if t2 == 0.0:
        return False, 0.0, 0.0, nowhere, nowhere, 0.0, 0.0
    density = _area_density(t2, dot(d, n))
    return density > 0.0, u, v, p, d, math.sqrt(t2), density


@device
def _part_density(o, a, ab, ac, p):
    """The density by solid angle at o with which `_sample_part` draws the point p."""
    n = cross(ab, ac)
    solid_angle = _spherical(a, add(a, ab), add(a, ac), n, o)
    if solid_angle > 0.0:
        return 1.0 / solid_angle
    d, t2 = _towards(p, o)
    return _area_density(t2, dot(d, n))


@device
def _density_with_cells(group, position, o, a, ab, ac, u, v, p):
    """The same of the cells of a triangle, mixed with that of the whole triangle where it is near.

    There distance and angle count for as much as emission, and cells are chosen by the latter alone.
    """
    part = cell_at(group.cells, u, v)
    corner, edge, other = cell_of_triangle(a, ab, ac, group.cells, part)
    density = cell_share(group, position, part) * _part_density(o, corner, edge, other, p)
    solid_angle = _spherical(a, add(a, ab), add(a, ac), cross(ab, ac), o)
    return (1.0 - _WHOLE) * density + _WHOLE / solid_angle if solid_angle > 0.0 else density


@inlined
def _area_density(distance2, along):
    """Density by solid angle of points uniform by area; along: the unit direction times twice the area's vector."""
    return 2.0 * distance2 / abs(along) if along != 0.0 else 0.0


@inlined
def put_point(scene, sp, instance, primitive, u, v, p, d, t, radiance, ls):
    """Fill ls, but for its density, with the point p of a triangle that sp sees at distance t along d."""
    put(ls.radiance, radiance)
    ls.light = -1
    placed = instance_at(scene.instances, instance)
    ls.blockers = placed.blockers
    ls.flags = 0 if ls.blockers == EVERYTHING else LIGHT_SAMPLE_DELTA
    ls.seen_by = placed.seen_by if reaches(placed.links, sp.light_set) else 0
    put(ls.wi, d)
    ls.distance = t
    put(ls.p, p)
    ls.uv[0] = u
    ls.uv[1] = v
    ls.instance = instance
    ls.primitive = primitive


@inlined
def _complete(scene, sp, scratch, instance, primitive, u, v, p, d, t, ls, sided):
    """`put_point` with what the triangle emits; False where `sided` and light sampling leaves that side out."""
    placed = instance_at(scene.instances, instance)
    index = primitive_material(scene, placed, mesh_at(scene.meshes, placed.mesh), primitive)
    material = material_at(scene.materials, index)
    radiance = vec(material.emission_estimate)
    one = sided and (material.emission_sampling == _FRONT or material.emission_sampling == _BACK)
    if one or material.flags & MATERIAL_VARYING_EMISSION:
        point = shadow_point(scratch, sp)
        surface_point(scene, point, instance, primitive, u, v, t, d)
        if one and not _sampled_side(scene, point):
            return False
        radiance = run_emission(scene, point)
    put_point(scene, sp, instance, primitive, u, v, p, d, t, radiance, ls)
    return True


@inlined
def _towards(p, o):
    """(unit direction, square of the distance) to p from o; zero where they are the same."""
    w = sub(p, o)
    t2 = dot(w, w)
    return scale(w, 1.0 / math.sqrt(t2) if t2 > 0.0 else 0.0), t2


@device
def place_triangle(scene, sp, scratch, instance, primitive, u, v, ls):
    """Fill ls with the point at barycentrics (u, v) as sp sees it; ls.pdf is the density of points uniform by area."""
    a, b, c = triangle_vertices(scene, instance, primitive)
    ab = sub(b, a)
    ac = sub(c, a)
    p = madd(madd(a, ab, u), ac, v)
    d, t2 = _towards(p, vec(sp.p))
    ls.pdf = _area_density(t2, dot(d, cross(ab, ac)))
    if ls.pdf == 0.0:
        return False
    t = math.sqrt(t2)
    return _complete(scene, sp, scratch, instance, primitive, u, v, p, d, t, ls, False)


@device
def even_density(scene, instance, primitive, p, o):
    """The density by solid angle at o of points uniform by area of a triangle, of its point p."""
    a, b, c = triangle_vertices(scene, instance, primitive)
    d, t2 = _towards(p, o)
    return _area_density(t2, dot(d, cross(sub(b, a), sub(c, a))))


@device
def place_even(scene, sp, instance, primitive, u, v, p, n, size, radiance, ls):
    """`place_triangle` where all is known: the point, its radiance, the unit normal n and twice the area."""
    d, t2 = _towards(p, vec(sp.p))
    ls.pdf = _area_density(t2, size * dot(d, n))
    put_point(scene, sp, instance, primitive, u, v, p, d, math.sqrt(t2), radiance, ls)
    return ls.pdf > 0.0


@device
def _triangle_chance(scene, sp, o):
    """The probability that a light sample at o is one of the triangle at sp; by tiles the mean number of candidates."""
    if scene.light_table == 0 or sp.instance < 0:
        return 0.0
    table = light_table_at(scene.light_table, 0)
    i = instance_at(scene.instances, sp.instance).lights
    if i < 0 or table.triangles == 0.0:
        return 0.0
    emitter = emitter_at(table.emitters, i)
    group = emitter_group_at(table.groups, emitter.group)
    if table.tiles != 0:
        candidates = table.triangles * light_tiles_at(table.tiles, 0).candidates
        return candidates * emitter.probability * load_f32(group.probabilities, sp.primitive)
    share = float(sp.light_shares[1])
    return share * triangle_share(table, emitter, group, sp.primitive, o, vec(sp.receiver)) if share > 0.0 else 0.0


@device
def triangle_pdf(scene, sp, o):
    """light_sample's mis_pdf (solid angle at o) for the point sp of an emissive triangle; 0 where never sampled.

    How light_sample chose at o stands in sp (lights.choice).
    """
    chance = _triangle_chance(scene, sp, o)
    if chance == 0.0:
        return 0.0
    side = -1.0 if sp.backfacing else 1.0  # surface_point has turned the tangents over
    ab = scale(vec(sp.dpdu), side)
    ac = scale(vec(sp.dpdv), side)
    p = vec(sp.p)
    table = light_table_at(scene.light_table, 0)
    if table.tiles != 0:
        d, t2 = _towards(p, o)
        return chance * _area_density(t2, dot(d, cross(ab, ac))) if t2 > 0.0 else 0.0
    if not _sampled_side(scene, sp):
        return 0.0
    a = madd(madd(p, ab, -sp.u), ac, -sp.v)
    group = emitter_group_at(
        table.groups, emitter_at(table.emitters, instance_at(scene.instances, sp.instance).lights).group
    )
    if group.cells == 1:
        return chance * _part_density(o, a, ab, ac, p)
    position = load_i32(group.positions, sp.primitive)
    return chance * _density_with_cells(group, position, o, a, ab, ac, float(sp.u), float(sp.v), p)
