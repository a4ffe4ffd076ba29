"""Where light leaves a medium: a point of the same object, seen from outside, with a white Lambert lobe."""

from ..core.jit import device
from ..core.records import MATERIAL_BUMPED_EXIT, closure_at, material_at
from ..core.vec import average, is_black, madd, neg, normalize, vec
from ..geometry.surface import surface_point
from ..lobes.closure import LOBE_LAMBERT, LOBE_SUBSURFACE, add_closure
from ..shading.interpreter import shader_eval


@device
def leave(scene, sp, primitive, u, v, t, d):
    """Move `sp` to a point of its own instance that light reaches from inside along d (unit, world space).

    What is outside is the side that d leads to. The lobe stands about the point's own normal: that of its subsurface
    lobes, for which the point's program runs, where these have normals of their own.
    """
    surface_point(scene, sp, sp.instance, primitive, u, v, t, neg(d))
    n = vec(sp.n)
    if material_at(scene.materials, sp.material).flags & MATERIAL_BUMPED_EXIT:
        n = _bumped(scene, sp, n)
    sp.from_inside = 1
    sp.n_closures = 0
    add_closure(sp, LOBE_LAMBERT, (1.0, 1.0, 1.0), n)


@device
def _bumped(scene, sp, smooth):
    """The mean normal of the subsurface lobes at `sp`, weighted as they are; `smooth` where there are none."""
    shader_eval(scene, sp)
    n = (0.0, 0.0, 0.0)
    for i in range(sp.n_closures):
        c = closure_at(sp.closures, i)
        if c.kind == LOBE_SUBSURFACE:
            n = madd(n, vec(c.n), average(vec(c.weight)))
    return smooth if is_black(n) else normalize(n)
