"""Where a material's displacement moves the vertices of a mesh."""

from ..core.jit import kernel
from ..core.memory import load_u32
from ..core.records import SCENE, tile_point
from ..core.vec import neg, store3_f32, transform_vector, vec
from ..geometry.placed import placed_at
from ..geometry.surface import surface_point, triangle_place
from .interpreter import displacement_eval


@kernel
def displacements(scene: SCENE, scratch, instance, places, count, out):
    """Run the displacement of the materials of an instance at corners of triangles.

    places: uint32 [count], three times the triangle plus which of its corners. out: float32 [count, 3], how far the
    program moves them in object space. As in Cycles a program sees the corner from outside, by no kind of ray.
    """
    sp = tile_point(scratch)
    placed = placed_at(scene, instance)
    for k in range(count):
        place = load_u32(places, k)
        primitive, corner = place // 3, place % 3
        u, v = 1.0 if corner == 1 else 0.0, 1.0 if corner == 2 else 0.0
        _p, ng, _area = triangle_place(scene, instance, primitive, u, v)
        surface_point(scene, sp, instance, primitive, u, v, 0.0, neg(ng))
        displacement_eval(scene, sp)
        store3_f32(out, k, transform_vector(placed.to_object, vec(sp.emission)))
