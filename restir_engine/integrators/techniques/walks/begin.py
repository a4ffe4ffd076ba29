"""How a walk would begin at an entrance, its own or another's."""

from ....kernels.core.fastmath import log
from ....kernels.core.jit import device, inlined
from ....kernels.core.vec import dot, length, madd, mul, put, scale, sub, transform_point, vec
from ....kernels.subsurface.entry import lobe_density, lobe_direction
from ....kernels.subsurface.phase import hg
from ....kernels.subsurface.walk import fall, pick, probabilities
from .entrance import LEAVES, SCATTERS


@device
def begin(placed, e, walk):
    """Set how the walk of an entrance would begin at another, e, or at its own, if nothing were in its way.

    e.begun: by channel what comes to its vertex and goes on there as it does, by the measures of the vertex and of
    directions; of a first segment that is done again what it lets through over its density. e.density: that of such a
    walk, but for the guiding behind the first segment. Both 0: it could not begin there. placed: its INSTANCE.
    """
    e.density = 0.0
    put(e.begun, (0.0, 0.0, 0.0))
    n, ng, wo = vec(e.n), vec(e.ng), vec(e.wo)
    p, carried, chances, before = vec(e.p), vec(e.carried), vec(e.chances), (0.0, 0.0, 0.0)
    if walk.bent:
        enters, before = lobe_direction(n, ng, wo, False, e.alpha, e.ior, walk.numbers[0], walk.numbers[1])
        chance = chances[0] + chances[1] + chances[2]
        t = _first_length(e, scale(chances, 1.0 / chance), walk.numbers[2], walk.numbers[3])
        sampled = mul(vec(e.sigma_t), _fallen(e, t))
        density = dot(chances, sampled)
        if not enters or not density > 0.0:
            return
        carried = scale(mul(mul(carried, vec(e.albedo)), sampled), chance / density)
        chances = scale(probabilities(carried, vec(e.albedo)), chance)
        p = madd(p, before, t)
        e.entered = t
    put(e.bend, transform_point(placed.to_object, p))
    between = sub(vec(walk.vertex), p)
    t = length(between)
    d = scale(between, 1.0 / t)
    e.distance = t
    measure = 1.0 / (t * t)
    if not walk.bent:
        measure *= lobe_density(n, ng, wo, walk.diffuse != 0, e.alpha, e.ior, d)
    elif e.g != 0.0:
        measure *= hg(dot(before, d), e.g)
    if walk.walk == LEAVES:
        measure *= max(dot(vec(walk.exit_n), d), 0.0)
    elif e.g != 0.0:
        measure *= hg(dot(d, vec(walk.d_behind)), e.g)
    if not measure > 0.0:
        return
    fallen = _fallen(e, t)
    begun, found = mul(carried, fallen), mul(chances, fallen)
    if walk.walk == SCATTERS:
        sigma_t = vec(e.sigma_t)
        begun, found = mul(begun, mul(sigma_t, vec(e.albedo))), mul(found, sigma_t)
    put(e.begun, scale(begun, measure))
    e.density = measure * (found[0] + found[1] + found[2])


@inlined
def _first_length(e, shares, u0, u1):
    """The length of a first segment, as a walk samples it; shares: probabilities of the channels."""
    return -log(1.0 - u1) / pick(shares, vec(e.sigma_t), u0)


@inlined
def _fallen(e, t):
    return (fall(e.sigma_t[0] * t), fall(e.sigma_t[1] * t), fall(e.sigma_t[2] * t))
