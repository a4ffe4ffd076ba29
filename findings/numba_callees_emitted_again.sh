#!/usr/bin/env bash
# Numba 0.68.1 (llvmlite 0.50.0): machine code of a function is made anew for every function above it that calls it,
# at any depth, and each time together with all that it calls itself.
#
# A chain of twelve functions of one size, each of which calls the one before. If each were compiled once there would be
# as much machine code in all as in the last one with its callees. Seen: each library holds all that stands below it, so
# that the sum over the chain grows with the square of its length. Instructions:
#   function 1: 312     function 12 with its callees: 1951     made in all: 13578
# What it means here: the small functions that kernels are made of (`kernels/core/compiled.py`) are kept as bitcode, and
# optimised and made code of once, in the kernel that calls them.
#
# Fails when this changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1 llvmlite==0.50.0
cat >"$folder/chain.py" <<'PYTHON'
import llvmlite
import numba

LINKS = 12
BODY = "\n".join(f"    x = x * 1.{k}1 + (x / ({k}.5 + x * x)) ** 0.{k}3" for k in range(1, 9))
names = {"numba": numba}
for i in range(LINKS):
    start = f"    x = f{i - 1}(x)\n" if i else ""
    exec(f"def f{i}(x):\n{start}{BODY}\n    return x", names)
    names[f"f{i}"] = numba.njit("float64(float64)")(names[f"f{i}"])
sizes = []
for i in range(LINKS):
    code = next(iter(names[f"f{i}"].inspect_asm().values()))
    sizes.append(sum(line.startswith("\t") and not line.startswith("\t.") for line in code.splitlines()))
print(f"numba {numba.__version__}, llvmlite {llvmlite.__version__}; instructions by function {sizes}")
print(f"all {sum(sizes)}, the last with its callees {sizes[-1]}")
assert sizes[-1] > 4 * sizes[0], "callees are no longer part of each caller's code"
assert sum(sizes) > 3 * sizes[-1], "each function's code is made once"
PYTHON
"$folder/venv/bin/python" "$folder/chain.py"
echo "as described"
