"""The sample of subsurface light, x₁ → x₂ → x₃: the exit x₂, the point x₃ of a light, and what x₃ brings to x₂.

How the probe found x₂ stands in the reservoir's flags. Its random numbers do not: they follow from x₁, x₂ and that.
"""

import numpy as np

from ....kernels.core.jit import inlined
from ....kernels.core.memory import record_at
from ....kernels.subsurface.bssrdf import BSSRDF
from ...resampling.reservoir import reservoir_dtype

SUBSURFACE = 3  # TECHNIQUE.id

# Flags: `irradiance` is not that of x₂ and x₃ as they are now; the mesh takes the outside for its inside.
NEEDS_LIGHT, TURNED = 1, 2
# Behind them the kind of the probe's line, its channel, and which of its hits x₂ is, the nearest first.
_LINE, _CHANNEL, _HIT = 4, 32, 128
UNKNOWN_HIT = 127  # which hit it is was not looked for

SAMPLE = np.dtype(
    [
        # x₂, of the same object as x₁.
        ("instance", np.int32),
        ("primitive", np.int32),
        ("u", np.float32),
        ("v", np.float32),
        # x₃, as kernels.lights.points has it.
        ("source", np.int32),
        ("light_primitive", np.int32),
        ("light_u", np.float32),
        ("light_v", np.float32),
        # rgb: radiance that leaves a white Lambert exit, by the measure of x₃; V is part of it.
        ("irradiance", np.float32, (3,)),
    ]
)
SUBSURFACE_RESERVOIR = reservoir_dtype(SAMPLE)
sample_at = record_at(SUBSURFACE_RESERVOIR)

EXIT = np.dtype(  # by which the path of the fresh candidate goes on
    [
        ("primitive", np.int32),  # NO_EXIT, NOT_SERVED: see there
        ("u", np.float32),
        ("v", np.float32),
        ("t", np.float32),
        ("normal", np.float32, (3,)),  # anything that points outwards
        ("weight", np.float32, (3,)),  # the throughput of the path behind it
        ("events", np.int32),  # of scattering
        ("dimension", np.int32),  # PATH.dimension behind it
    ]
)
NO_EXIT, NOT_SERVED = -1, -2  # the path ends here; it is followed by the method itself
# How a pixel's sample got there: it was found there; its exit was kept by a shift, or found again.
OWN, KEPT, REPLAYED = range(3)
WATCHED = np.dtype(  # what passes tell of a pixel's reuse
    [("origin", np.int32), ("shifts", np.int32), ("succeeded", np.int32), ("unused", np.int32)]
)
POINT = np.dtype([("bssrdf", BSSRDF), ("exit", EXIT), ("watched", WATCHED)])  # what is kept of a pixel
POINT_BYTES, _EXIT_OFFSET, _WATCHED_OFFSET = POINT.itemsize, POINT.fields["exit"][1], POINT.fields["watched"][1]
_exit_at = record_at(EXIT)
_watched_at = record_at(WATCHED)


@inlined
def point_of(frame, pixel):
    """The address of a pixel's POINT, which begins with its BSSRDF."""
    return frame.domains + POINT_BYTES * pixel


@inlined
def exit_of(frame, pixel):
    """The EXIT of a pixel."""
    return _exit_at(point_of(frame, pixel) + _EXIT_OFFSET, 0)


@inlined
def watched_of(frame, pixel):
    """The WATCHED of a pixel."""
    return _watched_at(point_of(frame, pixel) + _WATCHED_OFFSET, 0)


@inlined
def found_by(line, channel, hit):
    """The flags that tell how a probe found x₂."""
    return _LINE * line + _CHANNEL * channel + _HIT * hit


@inlined
def set_found_by(r, found):
    """Replace what a reservoir's flags tell of that."""
    r.flags = (r.flags & (NEEDS_LIGHT | TURNED)) | found


@inlined
def how_found(r):
    """(line, channel, hit) of a reservoir's flags."""
    flags = int(r.flags)
    return (flags // _LINE) & 7, (flags // _CHANNEL) & 3, (flags // _HIT) & 127
