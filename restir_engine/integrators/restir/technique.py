"""What RESTIR does with light samples: the settings as kernels read them."""

import numpy as np

from ...settings import RenderSettings

TECHNIQUE = np.dtype(
    [
        ("candidates", np.int64),  # light samples a pixel and frame, beside one direction by the BSDF
        ("target_visibility", np.int64),  # whether p̂ contains visibility
    ]
)


def technique_record(settings: RenderSettings) -> np.ndarray:
    """The TECHNIQUE record (1,)."""
    record = np.zeros(1, TECHNIQUE)
    record[0]["candidates"] = settings.restir_candidates
    record[0]["target_visibility"] = 1
    return record
