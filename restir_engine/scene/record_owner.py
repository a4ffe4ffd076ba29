"""A record that its owner fills in and that kernels reach by its address."""

from __future__ import annotations

import numpy as np

from ..kernels.core.memory import address


class RecordOwner:
    """The owner of `_record`, an array of one record, which lives as long as this."""

    _record: np.ndarray

    @property
    def record(self) -> np.void:
        """The record: a reference, not a copy."""
        return self._record[0]

    @property
    def address(self) -> int:
        """That of the record."""
        return address(self._record)
