#!/usr/bin/env bash
# Cycles in bpy 5.2.3: the Radial Tiling node (new in Blender 5.0) with exactly 2 sides and a roundness between 0 and 1
# gives widths of segments of minus millions. With 2.01 or 3 sides, or with a roundness of 0, they are below 100.
#
# A plane that emits the absolute value of Segment Width before an orthographic camera. Seen, the least and the most:
#    2 sides, roundness 0.5:                      4.5e6 … 5.4e6
#    2 sides, 0; 2.01 sides, 0.5; 3 sides, 0.5:   below 100
# What it means here: two sides are taken as if the roundness were 0 (kernels/shading/textures/radial.py).
#
# Takes Python 3.13 as $1 or python3. Fails when this changes.
set -euo pipefail
base=${1:-python3}
[ "$("$base" -c 'import sys; print("%d.%d" % sys.version_info[:2])')" = 3.13 ] || { echo "Python 3.13 is needed" >&2; exit 2; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$base" -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check "bpy==5.2.3"
timeout 600 "$folder/venv/bin/python" - "$folder" 2>/dev/null <<'PYTHON'
import os
import sys

import bpy
import numpy as np

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.render.resolution_x, scene.render.resolution_y = 32, 32
scene.view_settings.view_transform = "Raw"
scene.cycles.samples = 1
images = scene.render.image_settings
images.media_type, images.file_format, images.color_depth = "IMAGE", "OPEN_EXR", "32"
camera = bpy.data.cameras.new("Camera")
camera.type, camera.ortho_scale = "ORTHO", 1.9
scene.camera = bpy.data.objects.new("Camera", camera)
scene.camera.location.z = 2.0
scene.collection.objects.link(scene.camera)
bpy.ops.mesh.primitive_plane_add(size=2.0)
material = bpy.data.materials.new("Tiles")
bpy.context.object.data.materials.append(material)
tree = material.node_tree
tree.nodes.clear()
place = tree.nodes.new("ShaderNodeTexCoord")
tiles = tree.nodes.new("ShaderNodeRadialTiling")
size = tree.nodes.new("ShaderNodeMath")
size.operation = "ABSOLUTE"
light = tree.nodes.new("ShaderNodeEmission")
tree.links.new(place.outputs["Object"], tiles.inputs["Vector"])
tree.links.new(tiles.outputs["Segment Width"], size.inputs[0])
tree.links.new(size.outputs[0], light.inputs["Strength"])
tree.links.new(light.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])


def widths(sides, roundness):
    tiles.inputs["Sides"].default_value, tiles.inputs["Roundness"].default_value = sides, roundness
    scene.render.filepath = os.path.join(sys.argv[1], "picture.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(4 * 32 * 32, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    found = pixels.reshape(-1, 4)[:, 0]
    print(f"{sides:g} sides, roundness {roundness:g}: {found.min():g} … {found.max():g}", flush=True)
    return float(np.abs(found).max())


strange = widths(2.0, 0.5)
others = [widths(2.0, 0.0), widths(2.01, 0.5), widths(3.0, 0.5)]
os._exit(not (strange > 1e6 and max(others) < 1e3))
PYTHON
echo "as described"
