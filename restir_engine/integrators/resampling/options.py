"""What reuse is told: the REUSE record, and the names that settings give its choices."""

from __future__ import annotations

import numpy as np

from ...kernels.core.memory import record_at
from .mis import MIS_KINDS

# Where visibility V comes from:
# TARGET: a shadow ray wherever p̂ is evaluated, p̂ contains V. Unbiased.
# SHADED: p̂ is without V; shadow rays at the end, for what is shaded. Unbiased.
# REUSED: p̂ is without V; a sample carries the V it was found with, spatial neighbours' are traced again.
# ESTIMATED: likewise, but V̄ is averaged over what has been resampled (Tokuyoshi 2024), see `visibility`.
TARGET, SHADED, REUSED, ESTIMATED = range(4)
VISIBILITY = {"TARGET": TARGET, "SHADED": SHADED, "REUSED": REUSED, "ESTIMATED": ESTIMATED}

# Whose p̂ the frame before has in the MIS weights of temporal reuse: its own, with its scene and shadows; or, biased
# where something moves, what its vertices would have in the scene as it is now.
BEFORE, NOW = range(2)
HISTORY_TARGET = {"BEFORE": BEFORE, "NOW": NOW}

LUMINANCE = (0.2126, 0.7152, 0.0722)

REUSE = np.dtype(
    [
        ("light_samples", np.int64),  # a pixel and frame, beside one direction by the BSDF
        ("mis", np.int64),  # MIS_KINDS, for spatial reuse; temporal reuse has BALANCE where that is unbiased
        ("confidence_cap", np.float64),  # of the history, where 1 is one frame's candidates
        ("neighbours", np.int64),  # a pixel takes in each spatial pass
        ("radius", np.float64),  # pixels, within which they are
        ("world_radius", np.float64),  # scene units; 0: the radius is in pixels
        ("min_cosine", np.float64),  # see neighbours.similar
        ("max_depth", np.float64),
        ("visibility", np.int64),  # VISIBILITY
        ("discard", np.int64),  # candidates that are in shadow are thrown away: W ← 0
        ("near", np.float64),  # pixels, closer than which a neighbour's V is taken as it is; 0: none
        ("history_target", np.int64),  # HISTORY_TARGET
        ("vector", np.int64),  # shade by the vector-valued sum over what was resampled, not by the one selected
        ("channel", np.int64),  # the only one that these reservoirs are for; -1: one for all
        ("weights", np.float64, (3,)),  # of the channels in p̂
        ("seed", np.int64),  # of this frame
    ]
)

reuse_at = record_at(REUSE)

_CHOICES = {"mis": MIS_KINDS, "visibility": VISIBILITY, "history_target": HISTORY_TARGET}
_DEFAULTS = {
    "light_samples": 1,
    "mis": "DEFENSIVE",
    "confidence_cap": 20.0,
    "neighbours": 3,
    "radius": 16.0,
    "min_cosine": 0.5,
    "max_depth": 0.1,
    "visibility": "TARGET",
    "history_target": "BEFORE",
    "vector": True,
    "channel": -1,
}


def reuse_record(**options) -> np.ndarray:
    """The REUSE record (1,) of these fields, choices by name; p̂ is the luminance, or the channel asked for."""
    record = np.zeros(1, REUSE)
    for name, value in {**_DEFAULTS, **options}.items():
        record[0][name] = _CHOICES[name][value] if name in _CHOICES else value
    channel = record[0]["channel"]
    record[0]["weights"] = LUMINANCE if channel < 0 else np.eye(3)[channel]
    return record
