"""Visibility that is reused instead of traced (Tokuyoshi 2024, "Efficient Visibility Reuse for Real-time ReSTIR").

A reservoir carries V of its sample by channel. When samples are resampled, REUSED keeps that of the one selected;
ESTIMATED merges them by weighted importance sampling, V̄ = Σ w_i V̄_i / Σ w_i (eq. 4), whose denominator cancels in
f·V̄·W: no bias where p̂ is proportional to f, and less noise. With coloured lights p̂ is not: colours leak about the edges
of shadows, which one reservoir for each channel avoids.
"""

from ....kernels.core.jit import device, inlined
from ....kernels.core.vec import add, load3_f64, scale
from ...resampling.options import ESTIMATED, REUSED
from ...resampling.resample import weight_of
from ...resampling.reservoir import UNKNOWN


@inlined
def carried(reuse):
    """Whether samples carry a visibility of their own that counts."""
    return reuse.visibility >= REUSED


@inlined
def kept(reservoir):
    """V of the sample as it was last known, by channel."""
    return (float(reservoir.visibility[0]), float(reservoir.visibility[1]), float(reservoir.visibility[2]))


@inlined
def keep(reservoir, v):
    """Store V of the sample."""
    reservoir.visibility[0] = v[0]
    reservoir.visibility[1] = v[1]
    reservoir.visibility[2] = v[2]


@inlined
def forget(reservoir):
    """No shadow ray has been traced for the sample where it is now."""
    keep(reservoir, (UNKNOWN, 0.0, 0.0))


@device
def merged(reuse, table, visibilities, n, total, chosen):
    """V of what has been resampled from n candidates with `visibilities` (float64 [n, 3])."""
    if reuse.visibility != ESTIMATED:
        return load3_f64(visibilities, 3 * chosen)
    v = (0.0, 0.0, 0.0)
    for i in range(n):
        weight = weight_of(table, i)
        if weight > 0.0:
            v = add(v, scale(load3_f64(visibilities, 3 * i), weight / total))
    return v
