"""The camera's shutter: how much light it lets in at which time, and whether it reads line by line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels.core import records as rec
from ..kernels.core.jit import load
from ..kernels.core.memory import address
from ..kernels.geometry.placed import place
from ..kernels.path.shutter import aim


@dataclass(frozen=True, eq=False)
class Shutter:
    """curve: how open it is at even distances of time from 0 to 1, (n,); None: open all the time.

    rolling: the duration of a line by that of all lines, which are read from the top to the bottom; None: at once.
    """

    curve: np.ndarray | None = None
    rolling: float | None = None

    def record(self) -> tuple[np.ndarray, np.ndarray]:
        """The SHUTTER record (1,), and its table, which must live as long."""
        load([place, aim])
        table = inverse_cumulated(np.ones(2) if self.curve is None else self.curve)
        record = np.zeros(1, rec.SHUTTER)
        record[0]["table"], record[0]["place"], record[0]["aim"] = address(table), place.address, aim.address
        if self.rolling is not None:
            record[0]["rolling"], record[0]["duration"] = 1, min(max(self.rolling, 0.0), 1.0)
        return record, table


def inverse_cumulated(curve: np.ndarray) -> np.ndarray:
    """When a shutter has let in which share of all light: float32 (SHUTTER_TABLE_SIZE,). A closed one is open always.

    The curve is a line between its values.
    """
    curve = np.maximum(np.nan_to_num(np.asarray(curve, np.float64)), 0.0)
    if not curve.any():
        curve = np.ones(2)
    times = np.linspace(0.0, 1.0, 16 * rec.SHUTTER_TABLE_SIZE)
    open_at = np.interp(times, np.linspace(0.0, 1.0, len(curve)), curve)
    share = np.concatenate([[0.0], np.cumsum(0.5 * (open_at[1:] + open_at[:-1]))])
    share, first = np.unique(share / share[-1], return_index=True)
    return np.interp(np.linspace(0.0, 1.0, rec.SHUTTER_TABLE_SIZE), share, times[first]).astype(np.float32)
