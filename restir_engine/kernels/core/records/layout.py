"""How records are laid out: 64-bit fields only, int64 or float64, so that no field is ever padded."""

import numpy as np


def record(*fields: str | tuple[str, int]) -> np.dtype:
    """A dtype: a name is an int64 field, a pair (name, count) that many float64 (one: a scalar)."""
    result = []
    for field in fields:
        if isinstance(field, str):
            result.append((field, np.int64))
        else:
            name, count = field
            result.append((name, np.float64) if count == 1 else (name, np.float64, (count,)))
    return np.dtype(result)
