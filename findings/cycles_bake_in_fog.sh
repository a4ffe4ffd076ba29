#!/usr/bin/env bash
# Cycles in bpy 4.5.15 and 5.2.3: a bake takes the surface for one that stands outside of all objects' volumes, however
# it is placed. A sun that shines through one unit of an absorbing box dims a plane inside of it in a render, and not in
# a bake of its Diffuse light. Fog of the world dims both (not looked at here).
#
# A white plane in a box of Volume Absorption (density 1, black), lit from above by a sun through one unit of it, and seen
# from above by a camera inside of the box, close to it. Seen, by the value of the same without the box:
#    render: 0.37 (e^-1, and a hundredth between camera and plane)
#    bake: 1.00
# What it means here: bakes begin outside of such volumes too (docs/baking.md, tests/blender/test_bake.py).
#
# Takes Python 3.13 (bpy 5.2.3) or 3.11 (bpy 4.5.15) as $1 or python3. Fails when this changes.
set -euo pipefail
base=${1:-python3}
case $("$base" -c 'import sys; print("%d.%d" % sys.version_info[:2])') in
    3.13) version=5.2.3 ;;
    3.11) version=4.5.15 ;;
    *) echo "Python 3.11 or 3.13 is needed" >&2; exit 2 ;;
esac
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$base" -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check "bpy==$version"
timeout 600 "$folder/venv/bin/python" - "$folder" 2>/dev/null <<'PYTHON'
import math
import os
import sys

import bpy
import numpy as np

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples = "CYCLES", 16
scene.render.resolution_x = scene.render.resolution_y = 8
scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
images = scene.render.image_settings
if hasattr(images, "media_type"):
    images.media_type = "IMAGE"
images.file_format, images.color_depth = "OPEN_EXR", "32"
scene.render.filepath = os.path.join(sys.argv[1], "picture.exr")


def nodes(name):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial")


white, tree, output = nodes("White")
diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
diffuse.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
target = tree.nodes.new("ShaderNodeTexImage")
target.image = bpy.data.images.new("Target", 4, 4, float_buffer=True)
tree.nodes.active = target
fog, tree, output = nodes("Fog")
absorption = tree.nodes.new("ShaderNodeVolumeAbsorption")
absorption.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
absorption.inputs["Density"].default_value = 1.0
tree.links.new(absorption.outputs[0], output.inputs["Volume"])

bpy.ops.mesh.primitive_cube_add(size=2.0)
box = bpy.context.object
box.data.materials.append(fog)
bpy.ops.mesh.primitive_plane_add(size=0.5)
plane = bpy.context.object
plane.data.materials.append(white)
sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
sun.data.energy = 1.0
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.data.type, camera.data.ortho_scale, camera.location.z, camera.data.clip_start = "ORTHO", 0.1, 0.01, 0.001
for item in (sun, camera):
    scene.collection.objects.link(item)
scene.camera = camera


def rendered():
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    values = np.empty(4 * 64, np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values.reshape(-1, 4)[:, :3].mean()


def baked():
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT"}, margin=0)
    values = np.empty(4 * 16, np.float32)
    target.image.pixels.foreach_get(values)
    return values.reshape(-1, 4)[:, :3].mean()


with_box = rendered(), baked()
box.hide_render = True
without = rendered(), baked()
ratios = [float(a / b) for a, b in zip(with_box, without)]
print(bpy.app.version_string, "render", round(ratios[0], 4), "bake", round(ratios[1], 4), flush=True)
os._exit(0 if abs(ratios[0] - math.exp(-1.01)) < 0.01 and abs(ratios[1] - 1.0) < 0.01 else 1)
PYTHON
echo "as seen"
