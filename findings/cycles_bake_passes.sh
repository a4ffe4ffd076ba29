#!/usr/bin/env bash
# Cycles in bpy 4.5.15 and 5.2.3, bakes of a plane from -1 to 1:
#  - Position is added up over the samples: 16 samples give 16 times the place.
#  - UV is black where no node of the material asks for the map.
#  - Combined with Emission off still has a part of the light of a luminous mesh: what light samples find, by its MIS
#    weight; what rays find is left out. So it is neither without that light nor with all of it.
#
# Seen, both: a place of 0.875 at 16 samples is 14.0 or so; UV 0; direct diffuse light below a luminous plane, with and
# without Emission: 0.190 and 0.176 (Diffuse, direct and colour: 0.190)
# What it means here: docs/baking.md, "Where it differs from Cycles".
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

SIZE = 8
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.render.bake.margin = 0
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False


def plane(height, size):
    bpy.ops.mesh.primitive_plane_add(size=size, location=(0, 0, height))
    item, material = bpy.context.object, bpy.data.materials.new("Material")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    material.node_tree.nodes.clear()
    item.data.materials.append(material)
    return item, material.node_tree


def add(tree, shader):
    output, node = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new(shader)
    tree.links.new(node.outputs[0], output.inputs[0])


lamp, tree = plane(1.0, 1.4)
add(tree, "ShaderNodeEmission")
floor, tree = plane(0.0, 2.0)
add(tree, "ShaderNodeBsdfDiffuse")
node = tree.nodes.new("ShaderNodeTexImage")
node.image = bpy.data.images.new("Image", SIZE, SIZE, float_buffer=True)
node.image.colorspace_settings.name = "Non-Color"
tree.nodes.active = node


def bake(kind, samples, parts=None):
    scene.cycles.samples = samples
    bpy.ops.object.bake(type=kind, **({"pass_filter": parts} if parts else {}))
    pixels = np.empty(4 * SIZE * SIZE, np.float32)
    node.image.pixels.foreach_get(pixels)
    return pixels.reshape(SIZE, SIZE, 4)[..., :3]


place = [float(bake("POSITION", samples)[SIZE // 2, -1, 0]) for samples in (1, 16)]
uv = float(bake("UV", 1)[..., :2].max())
lit = {"DIFFUSE", "DIRECT"}
light = [float(bake(*what).mean()) for what in (("COMBINED", 1024, lit | {"EMIT"}), ("COMBINED", 1024, lit),
                                               ("DIFFUSE", 1024, {"DIRECT", "COLOR"}))]
print(f"bpy {bpy.app.version_string}: position {place}, UV {uv}, light {light}", flush=True)
added_up = abs(place[0] - 0.875) < 0.01 and abs(place[1] / 16 - place[0]) < 0.1
os._exit(not (added_up and uv == 0.0 and 0.5 < light[1] / light[0] < 0.98 and abs(light[2] / light[0] - 1) < 0.01))
PYTHON
echo "as described"
