"""Making what has been committed read-only."""

import numpy as np


def freeze(*values: object) -> None:
    """Make arrays read-only, in lists and tuples too; whatever else is left as it is."""
    for value in values:
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
        elif isinstance(value, (list, tuple)):
            freeze(*value)
