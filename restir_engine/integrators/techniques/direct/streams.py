"""What is streamed of a group's samples, for each layer of reservoirs: one is kept by weighted reservoir sampling."""

import math

import numpy as np

from ....kernels.core.jit import inlined
from ....kernels.core.memory import record_at
from ....kernels.core.records import LIGHT_HITTABLE, LIGHT_SAMPLE_DELTA, LIGHT_SAMPLE_NO_SHADOW, light_at, shared_area
from ....kernels.core.vec import mul
from ....kernels.lobes.classes import lobe_sum, put_lobes
from ....kernels.path.direct import LOBE_RAYS
from ...resampling.options import reuse_at
from ...resampling.reservoir import accept
from .target import brightness

# What is streamed through the reservoir of each layer, in that part of working memory that scattering uses otherwise.
POINT_FIELDS = [  # of a light: kernels.lights.points
    ("source", np.int64),
    ("primitive", np.int64),
    ("u", np.float64),
    ("v", np.float64),
]
STREAM = np.dtype(  # of a group's samples
    [
        ("total", np.float64),  # of the weights
        ("choice", np.float64),  # random number, what is left of it
        *POINT_FIELDS,  # of the sample kept
        ("bsdf", np.float64, (9,)),  # towards it, by class of lobes
        ("bsdf_ratio", np.float64),  # p_bsdf / p_lights of a light sample, 0 where rays do not find it
        ("origin", np.float64),  # SAMPLED, FOUND or CLEAR
    ]
)
# A light sample; what the ray by the BSDF finds, behind something; and what it finds with nothing in its way.
SAMPLED, FOUND, CLEAR = 0.0, 1.0, 2.0
WORK_STREAMS = shared_area(3 * STREAM.itemsize)
_stream_at = record_at(STREAM)


@inlined
def stream_of(scratch, layer):
    """The STREAM of a layer."""
    return _stream_at(scratch + WORK_STREAMS, layer)


@inlined
def start(record, u):
    """Begin a STREAM or GROUPS that chooses by the random number u."""
    record.total = 0.0
    record.choice = u


@inlined
def start_streams(scratch, layers, u):
    for layer in range(layers):
        start(stream_of(scratch, layer), u)


@inlined
def found_by_rays(scene, ls):
    """Whether the BSDF's directions find all that a light sends."""
    if ls.flags & (LIGHT_SAMPLE_DELTA | LIGHT_SAMPLE_NO_SHADOW) or ls.seen_by & LOBE_RAYS != LOBE_RAYS:
        return False
    return ls.light < 0 or light_at(scene.lights, ls.light).flags & LIGHT_HITTABLE != 0


@inlined
def offer(reuse, layers, scratch, f, radiance, factor, ratio, origin):
    """Stream a sample by the weight p̂ · factor; bits of the layers that keep it. f: the BSDF."""
    rgb = mul(lobe_sum(f), radiance)
    keepers = 0
    for layer in range(layers):
        stream = stream_of(scratch, layer)
        weight = brightness(reuse_at(reuse, layer), rgb) * factor
        if 0.0 < weight < math.inf:
            stream.total += weight
            chosen, u = accept(weight, float(stream.total), float(stream.choice))
            stream.choice = u
            if chosen:
                keepers |= 1 << layer
                stream.bsdf_ratio = ratio
                stream.origin = origin
                put_lobes(stream.bsdf, f)
    return keepers


@inlined
def keep_point(scratch, layers, keepers, source, primitive, u, v):
    """Note which point of a light the layers `keepers` keep."""
    for layer in range(layers):
        if keepers >> layer & 1:
            stream = stream_of(scratch, layer)
            stream.source = source
            stream.primitive = primitive
            stream.u = u
            stream.v = v


@inlined
def copy_point(to, source):
    """Copy a point of a light from one record to another."""
    to.source = source.source
    to.primitive = source.primitive
    to.u = source.u
    to.v = source.v


@inlined
def same_point(a, b):
    """Whether two streams have kept the same point."""
    return a.source == b.source and a.primitive == b.primitive and a.u == b.u and a.v == b.v
