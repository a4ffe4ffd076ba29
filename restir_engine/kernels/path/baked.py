"""Where the path of a pixel begins whose surface is baked: on that surface, as if a ray had just met it."""

from ..core import rng
from ..core.jit import device
from ..core.memory import load_f32, load_i32
from ..core.records import CAMERA_ORTHOGRAPHIC, point_in, texels_at
from ..core.vec import dot, length, madd, neg, normalize, put, scale, sub, vec
from ..geometry.intersect import put_nearest
from ..geometry.surface import hit_normal, offset_origin, surface_point, triangle_place

TRIES = 8  # to find a point of the texel that lies in the triangle; then it is the texel's centre
LEAST_COSINE = 0.2
GRAZING = 1e-3  # the least cosine to a triangle's own normal, whose other side would be seen else
_PLACE = 6  # floats of TEXELS.places


@device
def start_on_surface(scene, camera, integrator, scratch, path, x, y):
    """Let the path arrive at a point of pixel (x, y); False where that has no surface.

    The points of a pixel are even over what its triangle has of the texel. Its ray comes from just above the surface,
    and is said to end as far below it: by what the position may be wrong, so that it does not meet it again.
    """
    texels = texels_at(camera.texels, 0)
    index = y * texels.width + x
    primitive = load_i32(texels.primitives, index)
    if primitive < 0:
        return False
    path.key = rng.key(integrator.seed, load_i32(texels.seeds, index), 0, 0)
    place = texels.places + 4 * _PLACE * index
    u, v = load_f32(place, 0), load_f32(place, 1)
    if texels.jittered != 0:
        u, v = _point_in_texel(place, path.key, path.sample)
    sp = point_in(scratch)
    wo = _seen_from(scene, camera, texels, primitive, u, v)
    surface_point(scene, sp, texels.instance, primitive, u, v, 0.0, neg(wo))
    put(path.o, offset_origin(sp, wo))
    put(path.d, neg(wo))
    path.dp = _footprint(place, vec(sp.dpdu), vec(sp.dpdv))
    path.dd = 0.0
    put_nearest(scratch, 2.0 * sp.error, texels.instance, primitive, u, v)
    return True


@device
def _point_in_texel(place, key, sample):
    """Barycentrics (u, v) of a point of a texel, whose six floats are at an address, inside of its triangle."""
    u, v = load_f32(place, 0), load_f32(place, 1)
    for i in range(TRIES):
        x, y = rng.sample2(rng.key(key, i, 0, 0), sample, 0)
        a = u + (x - 0.5) * load_f32(place, 2) + (y - 0.5) * load_f32(place, 3)
        b = v + (x - 0.5) * load_f32(place, 4) + (y - 0.5) * load_f32(place, 5)
        if a >= 0.0 and b >= 0.0 and a + b <= 1.0:
            return a, b
    return u, v


@device
def _seen_from(scene, camera, texels, primitive, u, v):
    """The unit direction from which a point of the surface is seen: along its normal, or from the camera.

    As in Cycles, no camera looks flatter than by LEAST_COSINE, and the more it is behind the surface the more it looks
    along the normal.
    """
    p, ng, _ = triangle_place(scene, texels.instance, primitive, u, v)
    n = hit_normal(scene, texels.instance, primitive, u, v, (0.0, 0.0, 0.0))
    n = n if dot(n, ng) > 0.0 else ng
    if texels.from_camera == 0:
        return n
    to = camera.to_world
    wo = (to[2], to[6], to[10])
    if camera.kind != CAMERA_ORTHOGRAPHIC:
        wo = normalize(sub((to[3], to[7], to[11]), p))
    cosine = dot(wo, n)
    wo = normalize(madd(wo, n, max(LEAST_COSINE - cosine, 0.0)))
    if cosine < 0.0:
        wo = normalize(madd(scale(wo, 1.0 + cosine), n, -cosine))
    return normalize(madd(wo, ng, max(GRAZING - dot(wo, ng), 0.0)))


@device
def _footprint(place, dpdu, dpdv):
    """The mean length of a texel's two sides, as far as its point's derivatives tell."""
    dx = madd(scale(dpdu, load_f32(place, 2)), dpdv, load_f32(place, 4))
    dy = madd(scale(dpdu, load_f32(place, 3)), dpdv, load_f32(place, 5))
    return 0.5 * (length(dx) + length(dy))
