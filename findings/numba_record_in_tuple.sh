#!/usr/bin/env bash
# numba 0.68.1: a compiled function may return a record of a structured array, but not a tuple with a record in it.
#
# Typing accepts the tuple; lowering then fails with NotImplementedError, "use load_from_data_pointer() instead", which
# names neither the function nor the record. Seen:
#    return array[0]       (0, 3.0)
#    return array[0], 1    NotImplementedError
# What it means here: kernels that find a record return its index, and callers take the record by that.
#
# Fails when this changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1
cat >"$folder/records.py" <<'PYTHON'
import numba
import numpy as np

KIND = np.dtype([("a", np.int64), ("b", np.float64)])


@numba.njit
def alone(array):
    return array[0]


@numba.njit
def in_a_tuple(array):
    return array[0], 1


array = np.zeros(2, KIND)
array["b"] = 3.0
print("numba", numba.__version__, "alone:", alone(array))
assert alone(array)["b"] == 3.0
try:
    in_a_tuple(array)
except NotImplementedError as error:
    print("in a tuple:", error)
    assert "load_from_data_pointer" in str(error)
else:
    raise SystemExit("a tuple with a record can be returned now")
PYTHON
"$folder/venv/bin/python" "$folder/records.py"
echo "as described"
