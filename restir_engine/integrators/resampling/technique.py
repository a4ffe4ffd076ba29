"""What resampling knows of a technique: a row of entries, called by address; a domain, and a sample shifted to it.

    shift(from, to, reservoir, shifted)    T(x), the sample of a reservoir of `from` as one of `to`, and |T'|
    target(domain, shifted)                f and p̂ of the shifted sample in that domain
    shade(domain, shifted)                 f becomes what lights: whatever p̂ leaves out, V say, is multiplied in
    merge(domain, shifted, table, n, i)    what the sample chosen, the i-th of n, takes over from the others
    variate(domain, shifted)               f becomes the control variate of the domain, of mean 0

The last three may be missing: p̂ leaves out nothing, nothing is taken over, there is no control variate.
Arguments are addresses of DOMAIN, of a reservoir and of SHIFTED, and of the table of `resample`. A call costs 2 ns,
a shadow ray a thousand.
"""

import numpy as np

from ...kernels.core.jit import device, inlined, load
from ...kernels.core.memory import call_entry, copy_words, record_address, record_at
from ...kernels.lobes.classes import load_lobes, store_lobes
from .reservoir import RESERVOIR_BYTES, copy_reservoir, reservoir_at

TECHNIQUE = np.dtype(
    [
        ("id", np.int64),  # reservoirs of another technique are null samples to this one
        # Addresses of entries; 0 where there is none.
        ("shift", np.int64),
        ("target", np.int64),
        ("shade", np.int64),
        ("merge", np.int64),
        ("variate", np.int64),
        ("taker", np.int64),  # takes what a path finds that is replayed (kernels.film.contribute)
        # Address of the FILM of such paths:
        ("film", np.int64),
    ]
)
NOW, BEFORE = 0, 1
DOMAIN = np.dtype(  # a pixel of a frame, and all that p̂ is evaluated with there
    [
        ("pixel", np.int64),
        ("when", np.int64),  # NOW or BEFORE: of which of two frames scene and integrator are
        # Addresses:
        ("scene", np.int64),  # SCENE
        ("integrator", np.int64),  # INTEGRATOR
        ("frame", np.int64),  # FRAME
        ("motion", np.int64),  # MOTION from NOW to BEFORE; 0: there is only one frame
        ("reuse", np.int64),  # REUSE
        ("scratch", np.int64),  # working memory of the tile
    ]
)
SHIFTED = np.dtype(  # a sample in a domain that it was not made for
    [
        ("reservoir", np.int64, (RESERVOIR_BYTES // 8,)),  # header as it was, SAMPLE as it is there
        ("f", np.float64, (9,)),  # rgb by class of lobes (kernels.lobes.classes)
        ("target", np.float64),  # p̂; 0 where the shift has failed
        ("jacobian", np.float64),  # |T'|; 0 where the shift has failed
    ]
)
DOMAIN_BYTES, SHIFTED_BYTES = DOMAIN.itemsize, SHIFTED.itemsize
_F_OFFSET = SHIFTED.fields["f"][1]

technique_at = record_at(TECHNIQUE)
domain_at = record_at(DOMAIN)
shifted_at = record_at(SHIFTED)


def technique_row(number: int, **entries) -> np.ndarray:
    """The TECHNIQUE record (1,) of these `jit.Entry`, which are compiled where they are not yet."""
    row = np.zeros(1, TECHNIQUE)
    row[0]["id"] = number
    load(entries.values())
    for name, entry in entries.items():
        row[0][name] = entry.address
    return row


@inlined
def set_domain(domain, scene, integrator, frame, motion, reuse, scratch, when):
    """Fill a DOMAIN in but for its pixel; `motion` is an address."""
    domain.scene = record_address(scene)
    domain.integrator = record_address(integrator)
    domain.frame = record_address(frame)
    domain.motion = motion
    domain.reuse = record_address(reuse)
    domain.scratch = scratch
    domain.when = when


@device
def shift(reuse, start, to, reservoir, shifted):
    """T(x), |T'|, f and p̂ of the sample of a reservoir of the domain `start` in the domain `to` (all addresses).

    A null sample, one of another technique, and one whose shift fails have p̂ = 0.
    """
    row = technique_at(reuse.technique, 0)
    s = shifted_at(shifted, 0)
    s.target = 0.0
    s.jacobian = 0.0
    r = reservoir_at(reservoir, 0)
    if r.contribution_weight > 0.0 and r.technique == row.id:
        copy_reservoir(shifted, reservoir)
        call_entry(row.shift, start, to, reservoir, shifted, 0)
        if s.jacobian > 0.0:
            call_entry(row.target, to, shifted, 0, 0, 0)


@inlined
def load_f(shifted):
    """f of a SHIFTED record at an address, by class of lobes."""
    return load_lobes(shifted + _F_OFFSET, 0)


@inlined
def store_f(shifted, f):
    """Set f of a SHIFTED record at an address."""
    store_lobes(shifted + _F_OFFSET, 0, f)


@inlined
def copy_shifted(to, source):
    """Copy a SHIFTED record from one address to another."""
    copy_words(to, source, SHIFTED_BYTES // 8)


@inlined
def target_from(shifted):
    """p̂_{←j}(y) of a sample y that was shifted to the domain j, which is p̂_j(x) |x'(y)| (course, eq. 5.9)."""
    s = shifted_at(shifted, 0)
    return s.target * s.jacobian
