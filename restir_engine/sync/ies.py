"""IES files (LM-63): the intensities of luminaires, as tables of `kernels.shading.textures.ies`."""

from __future__ import annotations

import re

import bpy
import numpy as np

# Watt of a lamp that sends out a candela everywhere, at 177.83 lm/W: the luminous efficacy of D65, as Cycles has it.
_WATT_BY_CANDELA = 0.0706650768394
_TYPE_B, _TYPE_C = 2, 1


def ies_table(text: str) -> np.ndarray | None:
    """The table of a file's text; None where Cycles cannot use it either."""
    found = _read(text)
    if found is None:
        return None
    kind, horizontal, vertical, values = found
    found = _type_b(horizontal, vertical, values) if kind == _TYPE_B else _type_c(horizontal, vertical, values)
    if found is None:
        return None
    horizontal, vertical, values = found
    values = _with_ends(values, vertical[0] == 0.0)
    angles = np.radians(np.concatenate([horizontal, vertical]))
    return np.concatenate([[len(horizontal), len(vertical)], angles, values.ravel()]).astype(np.float32)


def _with_ends(values: np.ndarray, from_pole: bool) -> np.ndarray:
    """One more row and column at each end, for the cubic interpolation: through the lower pole as on the other side.

    Elsewhere Cycles means to go round too, but its test for the last angle fails by rounding: it takes what it falls
    back to, which was 0 before Blender 5.
    """
    kept = 1.0 if bpy.app.version >= (5, 0, 0) else 0.0
    below = values[:, 1] if from_pole else kept * values[:, 0]
    values = np.column_stack([below, values, kept * values[:, -1]])
    return np.vstack([kept * values[0], values, kept * values[-2]])


def _read(text: str) -> tuple[int, np.ndarray, np.ndarray, np.ndarray] | None:
    """(photometric type, horizontal angles, vertical angles, watt by horizontal and vertical angle), in degrees."""
    tilt = re.search(r"^TILT=(\S*).*$", text, re.MULTILINE)
    if tilt is None or tilt.start() == 0:
        return None
    try:
        numbers = [float(word) for word in text[tilt.end() :].replace(",", " ").split()]
        if tilt[1] == "INCLUDE":
            numbers = numbers[2 + 2 * int(numbers[1]) :]
        factor = numbers[2] * numbers[10] * numbers[11] * _WATT_BY_CANDELA
        n_vertical, n_horizontal, kind = (int(number) for number in numbers[3:6])
    except (ValueError, IndexError):
        return None
    data = np.array(numbers[13:])
    n_angles = n_vertical + n_horizontal
    if n_vertical < 2 or n_horizontal < 1 or len(data) < n_angles + n_vertical * n_horizontal:
        return None
    values = data[n_angles : n_angles + n_vertical * n_horizontal].reshape(n_horizontal, n_vertical)
    if kind not in (_TYPE_B, _TYPE_C):
        return None
    return kind, data[n_vertical:n_angles], data[:n_vertical], factor * values


def _type_c(horizontal, vertical, values) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """All the way round, about the axis that points down; quadrants and halves are mirrored."""
    if horizontal[0] == 90.0:
        horizontal = horizontal - 90.0
    if horizontal[0] != 0.0:
        return None
    if len(horizontal) == 1:
        horizontal, values = np.array([0.0, 360.0]), values[[0, 0]]
    for half in (90.0, 180.0):
        if horizontal[-1] == half:
            horizontal = np.concatenate([horizontal, 2.0 * half - horizontal[-2::-1]])
            values = np.concatenate([values, values[-2::-1]])
    if horizontal[-1] != 360.0:  # some files leave out what is the same as at 0
        missing = 360.0 - horizontal[-1]
        if missing not in (horizontal[-1] - horizontal[-2], horizontal[1] - horizontal[0]):
            return None
        horizontal, values = np.append(horizontal, 360.0), np.concatenate([values, values[:1]])
    if not (vertical[0] == 0.0 or (vertical[0] == 90.0 and vertical[-1] == 180.0)):
        return None
    return horizontal, vertical, values


def _type_b(horizontal, vertical, values) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Angles about a horizontal axis: turned, so that both run from 0, and mirrored where a half is given."""
    horizontal, vertical, values = vertical, horizontal, values.T
    found = []
    for axis, angles in enumerate((horizontal, vertical)):
        if angles[-1] != 90.0 or angles[0] not in (0.0, -90.0):
            return None
        if angles[0] == 0.0:
            angles = np.concatenate([-angles[:0:-1], angles])
            mirrored = np.flip(np.delete(values, 0, axis), axis)
            values = np.concatenate([mirrored, values], axis)
        found.append(angles + 90.0)
    horizontal, vertical = found
    return np.append(horizontal, 360.0), vertical, np.concatenate([values, values[:1]])
