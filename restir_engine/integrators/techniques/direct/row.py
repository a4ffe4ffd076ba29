"""Direct light's row in the table of techniques."""

import numpy as np

from ....reuse_settings import ReuseSettings
from ...resampling.technique import technique_row
from .sample import DIRECT_LIGHT
from .shift import shift_light
from .target import light_control_variate, target_light
from .visibility import merge_visibility, shade_light


def direct_technique(settings: ReuseSettings) -> np.ndarray:
    """Its TECHNIQUE record (1,); compiles the entries that the settings need, or loads them from the cache.

    Where nothing is reused there are none.
    """
    if not (settings.temporal or settings.rounds):
        return technique_row(DIRECT_LIGHT)
    entries = {"shift": shift_light, "target": target_light, "variate": light_control_variate}
    if settings.visibility != "TARGET":
        entries["shade"] = shade_light
    if settings.visibility in ("REUSED", "ESTIMATED"):
        entries["merge"] = merge_visibility
    return technique_row(DIRECT_LIGHT, **entries)
