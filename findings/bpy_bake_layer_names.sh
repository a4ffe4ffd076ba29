#!/usr/bin/env bash
# RenderEngine.bake in bpy 4.5.15 and 5.2.3: where an object has several images (one a material, or UDIM tiles), Blender
# calls `bake` once for each, and finds the image that a result is for by the name of the layer that `begin_result` was
# given. With the same name each time, each picture replaces the one before in the first image, and the others stay
# empty.
#
# An engine that fills the n-th image with n / 10; a cube of two materials. Seen, both, the values in the two images:
#    the same name for all:  0.2; nothing
#    a name for each:        0.1; 0.2
# What it means here: names are numbered (engine.py, `bake`).
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
timeout 600 "$folder/venv/bin/python" - 2>/dev/null <<'PYTHON'
import os

import bpy
import numpy as np


class Numbering(bpy.types.RenderEngine):
    bl_idname = bl_label = "NUMBERING"
    apart = False

    def update(self, data, depsgraph):
        self.count = 0

    def render(self, depsgraph):
        pass

    def bake(self, depsgraph, item, kind, parts, width, height):
        self.count += 1
        result = self.begin_result(0, 0, width, height, layer=f"Layer {self.count}" if self.apart else "Layer")
        result.layers[0].passes["Combined"].rect.foreach_set(np.full(4 * width * height, 0.1 * self.count, np.float32))
        self.end_result(result)


bpy.utils.register_class(Numbering)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.engine = "NUMBERING"
bpy.context.scene.render.bake.margin = 0
bpy.ops.mesh.primitive_cube_add()
cube, images = bpy.context.object, []
for i in range(2):
    material = bpy.data.materials.new("Material")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("Image", 16, 16, float_buffer=True)
    material.node_tree.nodes.active = node
    cube.data.materials.append(material)
    images.append(node.image)
cube.data.polygons[0].material_index = 1


def found(apart):
    Numbering.apart = apart
    bpy.ops.object.bake(type="EMIT")
    values = []
    for image in images:
        pixels = np.empty(4 * 16 * 16, np.float32)
        image.pixels.foreach_get(pixels)
        values.append(sorted(set(pixels[::4].round(3).tolist()) - {0.0}))
    print(f"bpy {bpy.app.version_string}, a name for each {apart}: {values}", flush=True)
    return [[round(value, 1) for value in each] for each in values]


os._exit(not (found(False) == [[0.2], []] and found(True) == [[0.1], [0.2]]))
PYTHON
echo "as described"
