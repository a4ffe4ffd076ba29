"""The integrand of light that crosses straight, and its target p̂, at any x₁ (talk c: the boundary term).

    f(ω, x₃) = w p(ω) e^(-σ_t r) E(x₂, x₃)          measure: solid angle of ω, coordinates of x₃

w is the closure's weight without its colour, p the density with which light enters along ω, r the way to x₂, the first
point of the object in that direction. E is that of subsurface light, V included: while x₂ stays, no light is asked.
"""

from ....kernels.core.jit import device, entry, inlined
from ....kernels.core.vec import length, mul, scale, sub, vec
from ....kernels.lobes.closure import P_ENTRY
from ....kernels.subsurface.entry import entry_density
from ....kernels.subsurface.hybrid import attenuation
from ...resampling.frame import frame_at
from ...resampling.inputs import point_at, scene_of
from ...resampling.options import reuse_at
from ...resampling.technique import domain_at, shifted_at, store_f
from ..subsurface.sample import NEEDS_LIGHT, sample_at
from ..subsurface.target import brightness, diffuse_lobes, light_sample_again, place_of
from .sample import closure_of, entry_of


@device
def density_of(frame, pixel, d):
    """The density with which light enters along d at a pixel that is served; 0: it does not."""
    sp, c = point_at(frame, pixel), closure_of(frame, pixel)
    return entry_density(vec(c.n), vec(sp.ng), vec(sp.wo), c.p[P_ENTRY], float(c.alpha_x), float(c.ior), d)


@inlined
def crossing(frame, pixel, r):
    """rgb: what is left of light that enters at a pixel, behind so long a way."""
    way = entry_of(frame, pixel)
    return mul(vec(way.weight), attenuation(vec(way.sigma_t), r))


@entry
def target_refraction(domain, shifted, a, b, c):
    """f and p̂ of a shifted sample (see resampling.technique)."""
    d = domain_at(domain, 0)
    frame = frame_at(d.frame, 0)
    sp, r = point_at(frame, d.pixel), sample_at(shifted, 0)
    x, n = place_of(scene_of(d), r)
    offset = sub(x, vec(sp.p))
    distance = length(offset)
    density = density_of(frame, d.pixel, scale(offset, 1.0 / max(distance, 1.0e-30)))
    if not density > 0.0:
        return
    if r.flags & NEEDS_LIGHT:
        light_sample_again(domain, r, x, n)
    f = scale(mul(crossing(frame, d.pixel, distance), vec(r.irradiance)), density)
    shifted_at(shifted, 0).target = brightness(reuse_at(d.reuse, 0), f)
    store_f(shifted, diffuse_lobes(f))
