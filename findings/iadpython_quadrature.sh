#!/usr/bin/env bash
# iadpython 0.5.3 (adding-doubling; with scipy 1.18.1): more quadrature points than 32 give wrong albedos without a
# word, where more points should only be more exact.
#
# A half space of albedo 0.5, isotropic, index-matched, returns 0.1152 of normal light and 0.1465 of diffuse light
# (Chandrasekhar 1960). Seen with `quad_pts`:
#    16: 0.1152 0.1465     32: 0.1152 0.1465     40: 0.0945 0.1056     64: 0.0419 0.0274     128: nan nan
# The nodes are roots of a Legendre polynomial in its power basis (scipy.special.legendre), which float64 cannot
# hold at these degrees. What it means here: tables and tests of this project ask for 16 points.
#
# Fails when this changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check iadpython==0.5.3 "scipy>=1.11" "numpy>=1.26"
"$folder/venv/bin/python" -W ignore - <<'PYTHON'
import iadpython
import numpy as np
import scipy

EXACT = np.array([0.11523, 0.14654])


def albedos(points):
    sample = iadpython.Sample(a=0.5, b=np.inf, g=0.0, n=1.0, n_above=1.0, n_below=1.0, quad_pts=points)
    reflected, _, diffuse, _ = sample.rt()
    return np.array([reflected, diffuse])


print(f"iadpython {iadpython.__version__}, scipy {scipy.__version__}; normal and diffuse albedo, exact {EXACT}")
for points in (16, 32, 40, 64, 128):
    print(points, albedos(points))
for points in (16, 32):
    assert np.allclose(albedos(points), EXACT, atol=5e-5), f"{points} points were right"
for points in (40, 64):
    assert (abs(albedos(points) / EXACT - 1) > 0.1).all(), f"{points} points have been mended"
assert np.isnan(albedos(128)).all(), "128 points have been mended"
PYTHON
echo "as described"
