"""Ashikhmin and Shirley 2000, "An Anisotropic Phong BRDF Model", its specular part without Fresnel."""

import math

from ..core.jit import device
from ..core.vec import add, dot, madd, neg, normalize, scale, to_world, vec
from .closure import closure_frame

_QUARTER = 0.5 * math.pi


@device
def _exponent(alpha):
    return 2.0 / max(alpha * alpha, 1e-12) - 2.0


@device
def ashikhmin_singular(c):
    """Whether the lobe is a mirror."""
    return max(c.alpha_x, c.alpha_y) <= 1e-4


@device
def ashikhmin_eval(c, wo, wi):
    """(value without the weight, pdf)."""
    n = vec(c.n)
    cos_o, cos_i = dot(n, wo), dot(n, wi)
    if ashikhmin_singular(c) or cos_o <= 0.0 or cos_i <= 0.0:
        return 0.0, 0.0
    h = normalize(add(wo, wi))
    cos_ho, cos_h = max(abs(dot(h, wo)), 1e-6), max(dot(h, n), 1e-6)
    nx, ny = _exponent(c.alpha_x), _exponent(c.alpha_y)
    e = nx
    if nx != ny and cos_h < 1.0:
        x, y = closure_frame(c)
        a, b = dot(h, x), dot(h, y)
        e = (nx * a * a + ny * b * b) / (1.0 - cos_h * cos_h)
    lobe = math.sqrt((nx + 1.0) * (ny + 1.0)) / (8.0 * math.pi) * (cos_h**e if cos_h < 1.0 else 1.0)
    return cos_i * lobe / max(cos_ho * max(cos_o, cos_i), 1e-6), lobe / cos_ho


@device
def ashikhmin_sample(c, wo, u0, u1):
    """A direction: wo mirrored on a normal of the distribution; n's mirror direction where it is singular."""
    n = vec(c.n)
    if ashikhmin_singular(c):
        return madd(neg(wo), n, 2.0 * dot(n, wo))
    x, y = closure_frame(c)
    nx, ny = _exponent(c.alpha_x), _exponent(c.alpha_y)
    quadrant = math.floor(4.0 * u0)
    u = 4.0 * u0 - quadrant
    odd = quadrant == 1.0 or quadrant == 3.0
    phi = math.atan(math.sqrt((nx + 1.0) / (ny + 1.0)) * math.tan(_QUARTER * (1.0 - u if odd else u)))
    if odd:
        phi = _QUARTER * (quadrant + 1.0) - phi
    else:
        phi = _QUARTER * quadrant + phi
    a, b = math.cos(phi), math.sin(phi)
    z = u1 ** (1.0 / (nx * a * a + ny * b * b + 1.0))
    r = math.sqrt(max(1.0 - z * z, 0.0))
    h = to_world((r * a, r * b, z), x, y, n)
    cos_ho = dot(h, wo)
    if cos_ho < 0.0:
        h, cos_ho = scale(h, -1.0), -cos_ho
    return madd(neg(wo), h, 2.0 * cos_ho)
