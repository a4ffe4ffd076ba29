"""Whole paths' row in the table of techniques."""

import numpy as np

from ....kernels.core.memory import address
from ....kernels.core.records import FILM
from ...resampling.technique import technique_row
from .collect import take_found
from .sample import PATH
from .shift import shift_path, target_path


def path_technique(light_groups: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Its TECHNIQUE record (1,), and the FILM (1,) of paths that are replayed, which must outlive it.

    light_groups: FILM.light_groups, of which such paths tell without adding to passes.
    """
    film = np.zeros(1, FILM)
    for name in FILM.names:
        film[name] = 0 if name in ("combined", "light_passes", "data_passes", "pixels") else -1
    film["light_groups"] = light_groups
    row = technique_row(PATH, shift=shift_path, target=target_path, taker=take_found)
    row[0]["film"] = address(film)
    return row, film
