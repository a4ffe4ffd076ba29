"""Subsurface light's rows in the table of techniques, one a round of spatial reuse."""

import numpy as np

from ....kernels.core.jit import Entry
from ...resampling.technique import technique_row
from .invert import redraw_line, redraw_numbers
from .sample import SUBSURFACE
from .shift import hybrid, reconnect, replay, replay_any_hit
from .target import target_subsurface
from .watch import WATCHED

# By settings.resampled_shift the entries of each round of spatial reuse; temporal reuse shifts as the first.
SHIFTS: dict[str, tuple[dict[str, Entry], ...]] = {
    "RECONNECTION": ({"shift": reconnect},),
    "DELAYED": ({"shift": replay},),
    "HYBRID": ({"shift": hybrid},),
    "SEQUENTIAL": ({"shift": reconnect, "merge": redraw_numbers}, {"shift": replay}),
    "SEQUENTIAL_FAST": ({"shift": reconnect, "merge": redraw_line}, {"shift": replay_any_hit}),
}


def subsurface_techniques(shift: str, watched: bool = False) -> list[np.ndarray]:
    """TECHNIQUE records (1,) of the rounds; compiles their entries, or loads them from the cache.

    watched: whether what reuse does is noted for passes.
    """
    rounds = SHIFTS[shift]
    if watched:
        rounds = [entries | {"merge": WATCHED[entries.get("merge")]} for entries in rounds]
    return [technique_row(SUBSURFACE, target=target_subsurface, **entries) for entries in rounds]
