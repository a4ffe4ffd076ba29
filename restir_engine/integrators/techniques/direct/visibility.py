"""Visibility that is reused instead of traced (Tokuyoshi 2024, "Efficient Visibility Reuse for Real-time ReSTIR").

A sample carries V by channel. When samples are resampled, REUSED keeps that of the one selected; ESTIMATED merges them
by weighted importance sampling, V̄ = Σ w_i V̄_i / Σ w_i (eq. 4), whose denominator cancels in f·V̄·W: no bias where p̂ is
proportional to f, and less noise. With colored lights p̂ is not: colors leak about the edges of shadows, which one
reservoir for each channel avoids.
"""

import numpy as np

from ....kernels.core.jit import device, entry
from ....kernels.core.vec import add, scale, vec
from ....kernels.lobes.classes import lobe_scale
from ...resampling.options import REUSED, reuse_at
from ...resampling.resample import weight_of
from ...resampling.technique import SHIFTED_BYTES, domain_at, load_f, store_f
from .sample import SEEN, direct_reservoir_at, keep
from .target import trace_visibility


@device
def known_visibility(domain, shifted):
    """V̄ of a shifted sample, by a shadow ray where it is not known."""
    r = direct_reservoir_at(shifted, 0)
    if r.flags & SEEN == 0:
        keep(r, trace_visibility(domain, shifted))
    return vec(r.visibility)


@entry
def shade_light(domain, shifted, a, b, c):
    """f V of a shifted sample (see resampling.technique), where p̂ is without V."""
    store_f(shifted, lobe_scale(load_f(shifted), known_visibility(domain, shifted)))


@entry
def merge_visibility(domain, shifted, table, n, chosen):
    """V̄ of what has been resampled from n samples SHIFTED goes to the one chosen (see resampling.technique)."""
    visibility = reuse_at(domain_at(domain, 0).reuse, 0).visibility
    own = shifted + SHIFTED_BYTES * chosen
    if visibility == REUSED:
        known_visibility(domain, own)
        return
    total = 0.0
    v = (0.0, 0.0, 0.0)
    for i in range(n):
        weight = weight_of(table, i)
        if weight > 0.0:
            total += weight
            v = add(v, scale(known_visibility(domain, shifted + SHIFTED_BYTES * i), weight))
    keep(direct_reservoir_at(own, 0), scale(v, 1.0 / total))


def visibility_of(reservoirs: np.ndarray) -> np.ndarray:
    """V̄ by channel of DIRECT_RESERVOIR (layers, height, width): a copy (height, width, 3), NaN where it is unknown."""
    known = (reservoirs["contribution_weight"] > 0.0) & (reservoirs["flags"] & SEEN != 0)
    v = np.where(known[..., None], reservoirs["visibility"], np.nan)
    return v[0] if len(v) == 1 else np.stack([v[c, :, :, c] for c in range(3)], -1)
