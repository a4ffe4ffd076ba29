#!/usr/bin/env bash
# bpy 4.5.15 and 5.2.3: foreach_get of triangles' "loops" and of polygons' "loop_start" is copied as a block into uint32
# arrays, and element by element into int32 ones: over a hundred times slower, with the same numbers.
#
# The documentation calls both "int", and the property's type is INT. Seen for a million triangles, best of three:
#    loops       5.2.3: int32 79 ms, uint32 0.5 ms    4.5.15: 117 and 0.6 ms
#    loop_start  5.2.3: int32 19 ms, uint32 0.05 ms   4.5.15:  11 and 0.06 ms
# What it means here: sync.mesh reads triangles as uint32.
#
# Takes Python 3.11 (bpy 4.5.15) or 3.13 (bpy 5.2.3), as $1 or python3. Fails when this changes.
set -euo pipefail
base=${1:-python3}
case $("$base" -c 'import sys; print("%d.%d" % sys.version_info[:2])') in
    3.11) version=4.5.15 ;;
    3.13) version=5.2.3 ;;
    *) echo "Python 3.11 or 3.13 is needed" >&2; exit 2 ;;
esac
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$base" -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check "bpy==$version"
timeout 300 "$folder/venv/bin/python" - <<'PYTHON'
import os
import time

import bpy
import numpy as np

n = 708
y, x = np.mgrid[0 : n + 1, 0 : n + 1].astype(np.float32)
corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
faces = np.stack([corner, corner + 1, corner + n + 2, corner + n + 1], 1).astype(np.int32)
mesh = bpy.data.meshes.new("Grid")
mesh.vertices.add(x.size)
mesh.loops.add(faces.size)
mesh.polygons.add(len(faces))
mesh.vertices.foreach_set("co", np.stack([x, y, 0 * x], 2).ravel())
mesh.loops.foreach_set("vertex_index", faces.ravel())
mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 4, dtype=np.int32))
mesh.update(calc_edges=True)


def read(collection, name, size, dtype):
    values, seconds = np.empty(size, dtype), []
    for _ in range(3):
        start = time.perf_counter()
        collection.foreach_get(name, values)
        seconds.append(time.perf_counter() - start)
    return min(seconds), values


status = 0
for collection, name, width in ((mesh.loop_triangles, "loops", 3), (mesh.polygons, "loop_start", 1)):
    size = width * len(collection)
    (slow, a), (fast, b) = (read(collection, name, size, dtype) for dtype in (np.int32, np.uint32))
    print(f"bpy {bpy.app.version_string}, {name} [{size}]: int32 {1e3 * slow:.2f} ms, uint32 {1e3 * fast:.2f} ms")
    status |= not np.array_equal(a, b) or slow < 10.0 * fast
os._exit(status)
PYTHON
echo "as described"
