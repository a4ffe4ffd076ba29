"""The sample of whole paths: the seed of the vertices that are replayed, and where others reconnect to it.

Vertex 1 is the pixel's own (the domain), vertex k the one that is kept, see `connect`. What lies behind it is kept as
radiance. A sample of light found by a ray that has no vertex to reconnect to is replayed as a whole.
"""

import numpy as np

from ....kernels.core.jit import inlined
from ....kernels.core.memory import record_at
from ....kernels.core.records import RAY_DIFFUSE, RAY_REFLECT, RAY_SINGULAR, RAY_TRANSPARENT
from ....kernels.core.warp import octahedral, octahedral_direction
from ....kernels.lobes.closure import LABEL_DIFFUSE, LABEL_GLOSSY, LABEL_REFLECT, LABEL_TRANSMIT
from ...resampling.reservoir import reservoir_dtype

PATH = 2  # TECHNIQUE.id

SAMPLE = np.dtype(
    [
        ("index", np.uint16),  # of the random numbers, with the header's seed as their key
        ("tags", np.uint16),  # hash of the labels of the bounces that are replayed
        # A point of a surface (instance, primitive, barycentrics) or of a light (kernels.lights.points); of a path that
        # is replayed as a whole `instance` tells what its last ray has found (What.source).
        ("instance", np.int32),
        ("primitive", np.int32),
        ("u", np.float32),
        ("v", np.float32),
        ("direction", np.int32),  # in which the path goes on from vertex k, see `pack_direction`
        ("radiance", np.float32, (3,)),  # that comes from there; of a light sample by the measure of its points
        # With which light sampling finds that light: by solid angle at vertex k, of AT_LIGHT by the measure of points
        # (as tiles draw it). 0: found by a ray only; below 0: by light sampling only.
        ("density", np.float32),
        ("jacobian", np.float32),  # the densities of the reconnection in the sample's own domain, multiplied
    ]
)
PATH_RESERVOIR = reservoir_dtype(SAMPLE)
path_reservoir_at = record_at(PATH_RESERVOIR)

# How a sample is shifted (`kind_of`): replayed as a whole; replayed up to the vertex before a light's point; up to that
# before a surface's point, which a light sample lights or from which the path went on by the BSDF.
REPLAYED, AT_LIGHT, LIT_THERE, WENT_ON = 0, 1, 2, 3

# Bits of a reservoir's flags: k, labels of the bounces from k - 1 and from k, the kind, and which side of vertex k.
MOST_VERTICES = 31
_BEFORE, _AT, _KIND, BACKFACING = 1 << 5, 1 << 7, 1 << 9, 1 << 11

# Labels of bounces as samples keep them: bit 1 reflects, bit 2 diffuse; what cannot be reconnected is above.
SINGULAR_TAG, TRANSPARENT_TAG = 4, 8


@inlined
def pack_flags(k, before, at, kind, backfacing):
    """Flags of a reservoir; before, at: tags of the bounces from the vertices k - 1 and k."""
    return k | before * _BEFORE | at * _AT | kind * _KIND | backfacing * BACKFACING


@inlined
def vertex_of(flags):
    """k."""
    return flags & MOST_VERTICES


@inlined
def kind_of(flags):
    """REPLAYED …"""
    return (flags // _KIND) & 3


@inlined
def label_before(flags):
    """The label (LABEL_*) of the bounce from vertex k - 1."""
    return label_of_tag((flags // _BEFORE) & 3)


@inlined
def label_at(flags):
    """The label of the bounce from vertex k."""
    return label_of_tag((flags // _AT) & 3)


@inlined
def label_of_tag(tag):
    """The label of a bounce that has a density."""
    return (LABEL_REFLECT if tag & 1 else LABEL_TRANSMIT) | (LABEL_DIFFUSE if tag & 2 else LABEL_GLOSSY)


@inlined
def tag_of(flags):
    """The tag of the bounce whose ray has these flags (RAY_*)."""
    if flags & RAY_TRANSPARENT:
        return TRANSPARENT_TAG
    tag = 1 if flags & RAY_REFLECT else 0
    if flags & RAY_DIFFUSE:
        tag += 2
    if flags & RAY_SINGULAR:
        tag += SINGULAR_TAG
    return tag


@inlined
def pack_direction(d):
    """A direction in 32 bits: the octahedral square in steps of 2⁻¹⁵, wrong by 5e-5."""
    x, y = octahedral(d)
    a, b = int(32768.0 * x + 32768.0), int(32768.0 * y + 32768.0)
    return (min(a, 65535) * 65536 + min(b, 65535)) - 2147483648


@inlined
def unpack_direction(bits):
    """The direction of `pack_direction`."""
    bits += 2147483648
    x, y = (bits // 65536) - 32767.5, (bits % 65536) - 32767.5
    return octahedral_direction(x * (1.0 / 32768.0), y * (1.0 / 32768.0))
