"""A record that its owner fills once and that kernels reach by its address."""

from __future__ import annotations

import numpy as np

from ..kernels.core.memory import address


class Table:
    """The owner of `_table`, an array of one record."""

    _table: np.ndarray

    @property
    def record(self) -> np.void:
        """The record."""
        return self._table[0]

    @property
    def address(self) -> int:
        """That of the record; valid as long as this lives."""
        return address(self._table)
