"""The pass Vector: where what a pixel shows was a frame before, and where it is to where it will be a frame after.

In pixels, as differences before - now and now - after (x, y each): what Cycles' motion vectors are.
"""

from ..core.jit import device, entry, inlined
from ..core.memory import call_entry, load_i32, load_i64, load_u32, record_address
from ..core.records import (
    CAMERA_ORTHOGRAPHIC,
    SHAPE_TRIANGLES,
    camera_at,
    film_at,
    instance_at,
    matrix_at,
    mesh_at,
    path_at,
    scene_at,
    shading_point_at,
    vectors_at,
)
from ..core.vec import add, load3_f32, madd, scale, transform_point, vec
from ..geometry.camera import camera_pixel
from .contribute import add1


@inlined
def add_vector(scene, film, path, point):
    """Add the pass where it is asked for; point: the address of the SHADING_POINT, 0: the path has left the scene."""
    if film.vector >= 0 and scene.vectors != 0:
        code = vectors_at(scene.vectors, 0).code
        call_entry(code, record_address(scene), record_address(film), record_address(path), point, 0)


@entry
def write_vector(scene, film, path, point, _):
    """Add the four numbers and the weight of one sample."""
    scene, film, path = scene_at(scene, 0), film_at(film, 0), path_at(path, 0)
    vectors = vectors_at(scene.vectors, 0)
    now = camera_at(scene.camera, 0)
    add1(path.pixel, film.vector_weight, 1.0)
    if point == 0 and now.kind == CAMERA_ORTHOGRAPHIC:
        return
    there, x, y = _now(now, path, point)
    for when in range(2):
        camera = _camera(now, when)
        if point == 0:
            seen, u, v = camera_pixel(camera, _ahead(camera, vec(path.d)))
        else:
            seen, u, v = camera_pixel(camera, _place(scene, vectors, shading_point_at(point, 0), when))
        if there and seen:
            sign = 1.0 if when == 0 else -1.0
            add1(path.pixel, film.vector + 2 * when, sign * (u - x))
            add1(path.pixel, film.vector + 2 * when + 1, sign * (v - y))


@device
def _now(camera, path, point):
    p = _ahead(camera, vec(path.d)) if point == 0 else vec(shading_point_at(point, 0).p)
    return camera_pixel(camera, p)


@device
def _camera(now, when):
    return now if now.around == 0 else camera_at(now.around, when)


@inlined
def _ahead(camera, d):
    """A point that a camera sees in the direction d."""
    return madd((camera.to_world[3], camera.to_world[7], camera.to_world[11]), d, 1.0)


@device
def _place(scene, vectors, sp, when):
    """Where the surface at sp is in the frame before (when 0) or after (1)."""
    row = load_i32(vectors.rows, sp.instance)
    mesh = mesh_at(scene.meshes, sp.mesh)
    vertices = load_i64(vectors.shapes, sp.mesh)
    if row < 0 and vertices == 0:
        return vec(sp.p)
    placed = instance_at(scene.instances, sp.instance)
    p = transform_point(placed.to_object, vec(sp.p))
    if vertices != 0 and mesh.shape == SHAPE_TRIANGLES:
        start = when * mesh.n_vertices
        a = load3_f32(vertices, start + load_u32(mesh.triangles, 3 * sp.primitive))
        b = load3_f32(vertices, start + load_u32(mesh.triangles, 3 * sp.primitive + 1))
        c = load3_f32(vertices, start + load_u32(mesh.triangles, 3 * sp.primitive + 2))
        p = add(scale(a, 1.0 - sp.u - sp.v), add(scale(b, sp.u), scale(c, sp.v)))
    if row < 0:
        return transform_point(placed.to_world, p)
    return transform_point(matrix_at(vectors.matrices, 2 * row + when).m, p)
