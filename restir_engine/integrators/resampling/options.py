"""What kernels know of ReuseSettings: the REUSE record."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from ...kernels.core.memory import record_at
from ...reuse_settings import OPTIONS, ReuseSettings

# Where visibility V comes from:
# TARGET: a shadow ray wherever p̂ is evaluated, p̂ contains V. Unbiased.
# SHADED: p̂ is without V; shadow rays at the end, for what is shaded. Unbiased.
# REUSED: p̂ is without V; a sample carries the V it was found with, spatial neighbours' are traced again.
# ESTIMATED: likewise, but V̄ is averaged over what has been resampled (Tokuyoshi 2024).
TARGET, SHADED, REUSED, ESTIMATED = range(4)

# Which pixels spatial reuse takes samples from, see `spatial`.
DISK, PAIRS = range(2)

# Whose p̂ the frame before has in the MIS weights of temporal reuse: its own, with its scene and shadows; or, biased
# where something moves, what its vertices would have in the scene as it is now.
OF_BEFORE, OF_NOW = range(2)

# What is resampled: direct light at first surfaces; indirect light; both.
DIRECT_PATHS, INDIRECT_PATHS, WHOLE_PATHS = range(3)

LUMINANCE = (0.2126, 0.7152, 0.0722)


def _number(value) -> type:
    return np.float64 if isinstance(value, float) else np.int64


REUSE = np.dtype(
    [
        *[(f.name, _number(f.default)) for f in fields(ReuseSettings)],  # a choice as its number
        ("technique", np.int64),  # address of its TECHNIQUE record
        ("channel", np.int64),  # the only one that these reservoirs are for; -1: one for all
        ("weights", np.float64, (3,)),  # of the channels in p̂
        ("seed", np.int64),  # of this frame
        ("left", np.int64),  # by how much blocks of PAIRS begin before multiples of their side in this frame
        ("below", np.int64),
    ]
)

reuse_at = record_at(REUSE)


def number_of(option: str, choice: str) -> int:
    """The number by which kernels know a choice."""
    return [name for name, _, _ in OPTIONS[option].choices].index(choice)


def reuse_records(settings: ReuseSettings, technique: int) -> np.ndarray:
    """REUSE of each layer of reservoirs: one whose p̂ is the luminance, or one for each channel.

    technique: the address of its TECHNIQUE record, which must outlive these.
    """
    channels = (0, 1, 2) if settings.by_channel else (-1,)
    records = np.zeros(len(channels), REUSE)
    for f in fields(settings):
        value = getattr(settings, f.name)
        records[f.name] = number_of(f.name, value) if OPTIONS[f.name].choices else value
    records["technique"] = technique
    for record, channel in zip(records, channels, strict=True):
        record["channel"] = channel
        record["weights"] = LUMINANCE if channel < 0 else np.eye(3)[channel]
    return records
