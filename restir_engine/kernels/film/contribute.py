"""Writing to the film: contributions by pass, clamps, data passes. A kernel owns the pixels of its tile."""

import math

from ..core.jit import device, inlined
from ..core.memory import load_f32, store_f32
from ..core.vec import vec


@inlined
def add1(pixel, offset, x):
    store_f32(pixel, offset, load_f32(pixel, offset) + x)


@inlined
def add3(pixel, offset, c):
    """Add to three channels of a pixel; an offset of -1 is a pass that nobody wants."""
    if offset >= 0:
        add1(pixel, offset, c[0])
        add1(pixel, offset + 1, c[1])
        add1(pixel, offset + 2, c[2])


@device
def set3(pixel, offset, c):
    if offset >= 0:
        store_f32(pixel, offset, c[0])
        store_f32(pixel, offset + 1, c[1])
        store_f32(pixel, offset + 2, c[2])


@inlined
def clamp_contribution(c, limit):
    """Scale a contribution whose channels add up to more than `limit`; one that is not finite becomes black."""
    total = abs(c[0]) + abs(c[1]) + abs(c[2])
    if not total < math.inf:
        return (0.0, 0.0, 0.0)
    if total > limit:
        s = limit / total
        return (c[0] * s, c[1] * s, c[2] * s)
    return c


# Instead of the shares of diffuse lobes: the first bounce was in a medium.
IN_MEDIUM = (-1.0, -1.0, -1.0)


@device
def add_light(film, pixel, c, indirect, diffuse, glossy):
    """Add a contribution to Combined and, by the shares of lobe classes at the first bounce, to the light passes."""
    add3(pixel, film.combined, c)
    if film.light_passes > 0 and diffuse[0] < 0.0:
        add3(pixel, film.volume_indirect if indirect else film.volume_direct, c)
    elif film.light_passes > 0:
        d = (c[0] * diffuse[0], c[1] * diffuse[1], c[2] * diffuse[2])
        g = (c[0] * glossy[0], c[1] * glossy[1], c[2] * glossy[2])
        t = (c[0] - d[0] - g[0], c[1] - d[1] - g[1], c[2] - d[2] - g[2])
        add3(pixel, film.diffuse_indirect if indirect else film.diffuse_direct, d)
        add3(pixel, film.glossy_indirect if indirect else film.glossy_direct, g)
        add3(pixel, film.transmission_indirect if indirect else film.transmission_direct, t)


@inlined
def add_scattered(film, path, c):
    """Add a contribution to the passes of the path's first subsurface scattering."""
    if path.scatter_pass != -1:
        add3(path.pixel, film.subsurface, c)
        add3(path.pixel, path.scatter_pass, c)


@inlined
def add_hit(film, integrator, path, radiance, mis, own_pass):
    """Add light that the path's ray found by itself; seen directly it belongs to `own_pass` (emission, environment)."""
    t = path.throughput
    c = (t[0] * radiance[0] * mis, t[1] * radiance[1] * mis, t[2] * radiance[2] * mis)
    c = clamp_contribution(c, integrator.clamp_indirect if path.bounce > 1 else integrator.clamp_direct)
    if path.bounce == 0:
        add3(path.pixel, film.combined, c)
        add3(path.pixel, own_pass, c)
    else:
        add_light(film, path.pixel, c, path.bounce > 1, vec(path.diffuse_weight), vec(path.glossy_weight))
    add_scattered(film, path, c)
    if path.denoise and film.denoising_albedo >= 0:
        f = path.feature_throughput
        add3(path.pixel, film.denoising_albedo, (f[0] * c[0], f[1] * c[1], f[2] * c[2]))
