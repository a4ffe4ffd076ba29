"""The rows of light that crosses straight in the table of techniques."""

import numpy as np

from ....kernels.core.jit import Entry
from ...resampling.technique import technique_row
from .sample import REFRACTION
from .shift import reconnect, turn
from .target import target_refraction

# By RenderSettings.sss_refraction. In time a sample whose x₂ was far away and has come near would keep a weight that is
# too large for there: see docs/results/hybrid.md.
SHIFTS: dict[str, Entry] = {"SPATIAL": reconnect, "TEMPORAL": turn}


def refraction_technique(reuse: str) -> np.ndarray:
    """TECHNIQUE record (1,) of a name of SHIFTS; compiles its entries, or loads them from the cache."""
    return technique_row(REFRACTION, shift=SHIFTS[reuse], target=target_refraction)
