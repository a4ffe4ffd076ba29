"""rgb by the class of lobes: what BSDFs return, and what the light passes tell apart."""

from typing import NamedTuple

from ..core.jit import inlined
from ..core.vec import add, load3_f64, mul, store3_f64


class Lobes(NamedTuple):
    """A value of the BSDF, or light that it sends on: rgb by the class of the lobes that it comes from."""

    diffuse: tuple[float, float, float]
    glossy: tuple[float, float, float]
    transmission: tuple[float, float, float]


_BLACK = (0.0, 0.0, 0.0)
NO_LOBES = Lobes(_BLACK, _BLACK, _BLACK)


@inlined
def lobe_sum(f):
    """The rgb that the classes add up to."""
    return (
        f.diffuse[0] + f.glossy[0] + f.transmission[0],
        f.diffuse[1] + f.glossy[1] + f.transmission[1],
        f.diffuse[2] + f.glossy[2] + f.transmission[2],
    )


@inlined
def share(part, whole):
    """part / whole, 0 of nothing; what light tiles leave out of their samples, to make up for it, may be below 0."""
    return part / whole if whole != 0.0 else 0.0


@inlined
def lobe_scale(f, rgb):
    """Every class times a factor by channel."""
    return Lobes(mul(f.diffuse, rgb), mul(f.glossy, rgb), mul(f.transmission, rgb))


@inlined
def lobe_add(f, g):
    """The sum of two, class by class."""
    return Lobes(add(f.diffuse, g.diffuse), add(f.glossy, g.glossy), add(f.transmission, g.transmission))


@inlined
def put_lobes(a, f):
    """Store in a record's (9,) field."""
    for k in range(3):
        a[k] = f.diffuse[k]
        a[3 + k] = f.glossy[k]
        a[6 + k] = f.transmission[k]


@inlined
def lobes_of(a):
    """What stands in a record's (9,) field."""
    return Lobes((a[0], a[1], a[2]), (a[3], a[4], a[5]), (a[6], a[7], a[8]))


@inlined
def load_lobes(address, index):
    """The index-th nine float64 at an address."""
    i = 9 * index
    return Lobes(load3_f64(address, i), load3_f64(address, i + 3), load3_f64(address, i + 6))


@inlined
def store_lobes(address, index, f):
    """Write the index-th nine float64 at an address."""
    i = 9 * index
    store3_f64(address, i, f.diffuse)
    store3_f64(address, i + 3, f.glossy)
    store3_f64(address, i + 6, f.transmission)
