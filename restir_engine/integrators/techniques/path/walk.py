"""A path between its vertices, as it is made and as it is replayed: where it may be reconnected.

A path reconnects to its first vertex k ≥ 2 that is connectable with the one before (course, ch. 6; Lin et al. 2022):

    max(p_{k-1} G(x_{k-1} → x_k), p_k G(x_k → x_{k-1}))⁻¹ ≥ c/100 · 4π |x_1 - x_0|² / cos θ_1     (dual footprint)
    p_{k-1}⁻², p_k⁻² ≥ α                                                                   (black-box roughness)

(ReSTIR PT Enhanced, eq. 5 and 26), p being the BSDF's density by solid angle over all lobes and G(a → b) = cos θ_b /
|b - a|². A shift succeeds where the same k is the first connectable one of the offset path too, so that it can be
shifted back. Replayed bounces keep their labels: with these a path's counters, limits and flags are the same.
"""

import math

import numpy as np

from ....kernels.core import rng
from ....kernels.core.jit import inlined
from ....kernels.core.memory import record_address, record_at
from ....kernels.core.records import (
    INTEGRATOR,
    RAY_SINGULAR,
    RAY_TRANSPARENT,
    SCRATCH_TAKER,
    SHAPE_TRIANGLES,
    TAKER,
    TAKER_BYTES,
)
from ....kernels.core.vec import dot, put, sub, vec
from ....kernels.film.contribute import NOT_FOUND
from ....kernels.lobes import label_pdf
from ...resampling.reservoir import RESERVOIR_BYTES
from .sample import label_of_tag, tag_of

WALK = np.dtype(
    [
        *[
            (name, *TAKER.fields[name][0].subdtype) if TAKER.fields[name][0].subdtype else (name, TAKER.fields[name][0])
            for name in TAKER.names
        ],
        ("reuse", np.int64),  # address of REUSE
        ("integrator", np.int64),  # address of INTEGRATOR
        ("vertex", np.int64),  # j: which vertex the path is at
        ("footprint", np.float64),  # c/100 · 4π |x_1 - x_0|² / cos θ_1
        ("largest_pdf", np.float64),  # α^(-1/2)
        # Of vertex j - 1 and the bounce from it:
        ("before", np.float64, (3,)),
        ("before_cosine", np.float64),
        ("pdf", np.float64),  # over all lobes; 0: it is singular, or the ray passes through the surface
        ("label_pdf", np.float64),  # with its label
        ("tag", np.int64),
        ("tags", np.int64),  # hash of the tags of the bounces before that
        # REPLAYED: what the last ray is to find, and has found.
        ("source", np.int64),
        ("found", np.float64, (3,)),
        ("found_group", np.int64),  # the light group of that
        # A path in the making:
        ("bounces", np.int64),  # at vertex 1
        ("prefix", np.float64, (3,)),  # its throughput there
        ("survival", np.float64),  # Π q of Russian roulette
        ("k", np.int64),  # vertex that the path is reconnected at; 0: none so far
        ("bounces_there", np.int64),  # with the bounce there
        ("jacobian", np.float64),
        ("behind", np.float64),  # PATH.throughput as it was set behind vertex k
        ("survival_before", np.float64),  # Π q up to there
        ("throughput", np.float64, (3,)),  # up to and with the bounce at vertex k, without roulette
        ("total", np.float64),  # Σ w of the samples so far
        ("choice", np.float64),
        ("target", np.float64),  # p̂ of the one kept
        ("f", np.float64, (9,)),
        ("connection", np.int64, (RESERVOIR_BYTES // 8,)),  # a reservoir: what samples behind vertex k share
        ("kept", np.int64, (RESERVOIR_BYTES // 8,)),
    ],
    align=True,
)
INTEGRATOR_BYTES = INTEGRATOR.itemsize
WORK_INTEGRATOR = SCRATCH_TAKER + WALK.itemsize  # a copy of the integrator without roulette
WORK_PIXEL = WORK_INTEGRATOR + INTEGRATOR_BYTES  # where replayed paths write to
if WALK.itemsize + INTEGRATOR_BYTES + 64 > TAKER_BYTES:
    raise ValueError("a path's walk needs more working memory")

_CONNECTION_OFFSET, _KEPT_OFFSET = (WALK.fields[name][1] for name in ("connection", "kept"))

_walk_at = record_at(WALK)


@inlined
def walk_of(scratch):
    """The tile's WALK."""
    return _walk_at(scratch + SCRATCH_TAKER, 0)


@inlined
def walk_at(address):
    """The WALK at an address."""
    return _walk_at(address, 0)


@inlined
def connection_of(walk):
    """The address of walk.connection."""
    return record_address(walk) + _CONNECTION_OFFSET


@inlined
def kept_of(walk):
    """The address of walk.kept."""
    return record_address(walk) + _KEPT_OFFSET


@inlined
def start_walk(walk, reuse, sp):
    """Begin at vertex 1, a SHADING_POINT."""
    walk.vertex = 1
    cosine = max(abs(dot(vec(sp.n), vec(sp.wo))), 1e-3)
    walk.footprint = reuse.footprint * 0.01 * 4.0 * math.pi * sp.t * sp.t / cosine
    walk.largest_pdf = 1.0 / math.sqrt(reuse.connect_roughness)
    walk.pdf = walk.label_pdf = 0.0
    walk.tag = walk.tags = walk.k = 0
    walk.source = NOT_FOUND


@inlined
def connects(walk, sp, pdf):
    """Whether the path could be reconnected at its vertex sp, where it goes on with a density `pdf`."""
    if walk.vertex < 2 or walk.pdf <= 0.0 or pdf <= 0.0:
        return False
    # What is kept is a point of a triangle; ribbons, which turn towards each ray, have none that two paths share.
    if sp.shape != SHAPE_TRIANGLES:
        return False
    if max(pdf, walk.pdf) > walk.largest_pdf:
        return False
    return _wide(walk, vec(walk.before), walk.before_cosine, walk.pdf, sp, pdf)


@inlined
def _wide(walk, before, cosine, pdf_before, sp, pdf):
    between = sub(vec(sp.p), before)
    square = dot(between, between)
    arrival = abs(dot(vec(sp.ng), between)) / math.sqrt(max(square, 1e-60))
    return max(pdf_before * arrival, pdf * cosine) * walk.footprint <= square


@inlined
def geometry(sp, before):
    """cos θ at the arrival sp over the squared distance from `before`."""
    between = sub(vec(sp.p), before)
    square = max(dot(between, between), 1e-60)
    return abs(dot(vec(sp.ng), between)) / (square * math.sqrt(square))


@inlined
def bounce_pdf(path):
    """The density over all lobes of the bounce just made; 0: it is singular, or has passed through the surface."""
    return 0.0 if path.flags & (RAY_SINGULAR | RAY_TRANSPARENT) else path.mis_pdf


@inlined
def note_bounce(walk, path, sp):
    """Note how the path leaves its vertex sp, after `bounce`."""
    if walk.vertex > 1:
        walk.tags = rng.hash_combine(walk.tags, walk.tag)
    walk.tag = tag_of(path.flags)
    put(walk.before, vec(sp.p))
    d = vec(path.d)
    walk.before_cosine = abs(dot(vec(sp.ng), d))
    walk.pdf = bounce_pdf(path)
    walk.label_pdf = walk.pdf
    if walk.pdf > 0.0 and sp.n_closures > 1:
        walk.label_pdf = label_pdf(sp, d, label_of_tag(walk.tag))


@inlined
def replayed_tags(walk):
    """Hash of the tags of all bounces so far, in 16 bits."""
    return rng.hash_combine(walk.tags, walk.tag) & 0xFFFF


@inlined
def tags_before(walk):
    """Hash of the tags of all bounces but the last, in 16 bits."""
    return walk.tags & 0xFFFF
