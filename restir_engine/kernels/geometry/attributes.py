"""Attributes of meshes and instances at a shading point, found by their interned names."""

from ..core.jit import device
from ..core.memory import load_f32, load_i32, load_u32
from ..core.records import (
    ATTRIBUTE_GENERATED,
    DOMAIN_CORNER,
    DOMAIN_FACE,
    DOMAIN_MESH,
    DOMAIN_POINT,
    DOMAIN_VOXEL,
    SHAPE_SPHERES,
    SHAPE_STRANDS,
    SHAPE_TRIANGLES,
    attribute_at,
    instance_at,
    mesh_at,
)
from ..core.vec import add, load3_f32, madd, scale, transform_point, vec
from .placed import placed_at
from .voxels import voxel_values


@device
def attribute(scene, sp, name, du, dv):
    """An attribute at (u + du, v + dv) of a primitive, on strands at u + du alone: (found, x, y, z, w).

    One component stands in x, y and z, two in x and y; w is 1 where the attribute has no fourth. Not found: zeros. The
    mesh is asked first, then the instance. At points inside of a mesh (primitive -1) its grids of voxels are asked.
    """
    if sp.instance < 0:
        return False, 0.0, 0.0, 0.0, 0.0
    mesh = mesh_at(scene.meshes, sp.mesh)
    for i in range(mesh.n_attributes):
        entry = attribute_at(mesh.attributes, i)
        if entry.name == name:
            if sp.primitive < 0:
                return _inside(scene, sp, entry)
            return _interpolate(mesh, entry, sp.primitive, sp.u + du, sp.v + dv)
    instance = instance_at(scene.instances, sp.instance)
    for i in range(instance.n_attributes):
        entry = attribute_at(instance.attributes, i)
        if entry.name == name:
            return _interpolate(mesh, entry, sp.primitive, 0.0, 0.0)
    return False, 0.0, 0.0, 0.0, 0.0


@device
def _inside(scene, sp, entry):
    """A mesh's attribute at a point inside of it, where there are voxels alone; as `attribute` has it.

    Colours with an alpha are divided by it, as Cycles does behind its interpolation.
    """
    if entry.domain != DOMAIN_VOXEL:
        return False, 0.0, 0.0, 0.0, 0.0
    p = transform_point(instance_at(scene.instances, sp.instance).to_object, vec(sp.p))
    x, y, z, w = voxel_values(entry.values, p)
    if w > 1.0e-6 and w != 1.0:
        return True, x / w, y / w, z / w, w
    return True, x, y, z, w


@device
def mesh_components(scene, sp, name):
    """How many components the mesh's attribute of this name has, 0 without one."""
    mesh = mesh_at(scene.meshes, sp.mesh)
    for i in range(mesh.n_attributes):
        entry = attribute_at(mesh.attributes, i)
        if entry.name == name:
            return entry.components
    return 0


@device
def generated(scene, sp, du, dv):
    """Generated texture coordinates at barycentrics (u + du, v + dv), those of the undeformed shape where it is known.

    For world and lights (`sp.instance < 0`): (0, 0, 0).
    """
    if sp.instance < 0:
        return (0.0, 0.0, 0.0)
    found, x, y, z, _ = attribute(scene, sp, ATTRIBUTE_GENERATED, du, dv)
    if found:
        return (x, y, z)
    mesh = mesh_at(scene.meshes, sp.mesh)
    if sp.primitive < 0:  # a point inside
        p = transform_point(instance_at(scene.instances, sp.instance).to_object, vec(sp.p))
    elif mesh.shape != SHAPE_TRIANGLES:
        p = madd(madd(vec(sp.p), vec(sp.dpdu), du), vec(sp.dpdv), dv)
        p = transform_point(placed_at(scene, sp.instance).to_object, p)
    else:
        p = object_point(mesh, sp.primitive, sp.u + du, sp.v + dv)
    return (
        (p[0] - mesh.generated_offset[0]) * mesh.generated_scale[0],
        (p[1] - mesh.generated_offset[1]) * mesh.generated_scale[1],
        (p[2] - mesh.generated_offset[2]) * mesh.generated_scale[2],
    )


@device
def object_point(mesh, primitive, u, v):
    """The point of a triangle at barycentrics (u, v), in object space."""
    a = load3_f32(mesh.vertices, load_u32(mesh.triangles, 3 * primitive))
    b = load3_f32(mesh.vertices, load_u32(mesh.triangles, 3 * primitive + 1))
    c = load3_f32(mesh.vertices, load_u32(mesh.triangles, 3 * primitive + 2))
    return add(scale(a, 1.0 - u - v), add(scale(b, u), scale(c, v)))


@device
def _interpolate(mesh, entry, primitive, u, v):
    if mesh.shape == SHAPE_SPHERES:
        a = primitive * entry.components if entry.domain == DOMAIN_POINT else 0
        b = a
        c = a
    elif mesh.shape >= SHAPE_STRANDS and entry.domain != DOMAIN_MESH:
        strand = load_i32(mesh.strands, primitive)
        a = strand * entry.components
        b = a
        if entry.domain == DOMAIN_POINT:
            # Attributes have no values for the first and last points once more, which `segments` counts.
            a = (load_u32(mesh.segments, primitive) - 2 * strand) * entry.components
            b = a + entry.components
        c = a
        v = 0.0
    elif entry.domain == DOMAIN_POINT or entry.domain == DOMAIN_CORNER:
        table = mesh.triangles if entry.domain == DOMAIN_POINT else mesh.corners
        a = load_u32(table, 3 * primitive) * entry.components
        b = load_u32(table, 3 * primitive + 1) * entry.components
        c = load_u32(table, 3 * primitive + 2) * entry.components
    else:
        a = 0
        if entry.domain == DOMAIN_FACE:
            a = load_i32(mesh.polygons, primitive) * entry.components
        b = a
        c = a
    values = entry.values
    x = _blend(values, a, b, c, u, v)
    if entry.components == 1:
        return True, x, x, x, 1.0
    y = _blend(values, a + 1, b + 1, c + 1, u, v)
    z = 0.0
    w = 1.0
    if entry.components > 2:
        z = _blend(values, a + 2, b + 2, c + 2, u, v)
    if entry.components > 3:
        w = _blend(values, a + 3, b + 3, c + 3, u, v)
    return True, x, y, z, w


@device
def _blend(values, a, b, c, u, v):
    return load_f32(values, a) * (1.0 - u - v) + load_f32(values, b) * u + load_f32(values, c) * v
