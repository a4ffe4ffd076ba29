#!/usr/bin/env bash
# Cycles in bpy 5.2.3: the pass Vector of the world behind everything is too short, by the cosine between the ray and
# the view axis: its projection of a direction leaves out the division by w. In 4.5.15 it is 0. Surfaces are right.
#
# An empty picture and a lens that goes from 48 to 52 mm in two frames: in half of that a pixel x from the middle moves
# by 0.04 x. Seen: 0.04 x times the cosine to four digits, 10 % less in the corners (5.2.3); 0 (4.5.15).
# What it means here: tests/blender/test_vector_pass.py compares vectors of surfaces with Cycles', and those of the
# world with what they should be.
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
timeout 600 "$folder/venv/bin/python" - "$folder" 2>/dev/null <<'PYTHON'
import os
import sys

import bpy
import numpy as np

SIZE = 48
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.render.resolution_x = scene.render.resolution_y = SIZE
scene.cycles.samples, scene.cycles.use_adaptive_sampling = 16, False
scene.cycles.pixel_filter_type = "BOX"
scene.view_layers[0].use_pass_vector = True
camera = bpy.data.cameras.new("Camera")
scene.camera = bpy.data.objects.new("Camera", camera)
scene.collection.objects.link(scene.camera)
for frame, lens in ((1, 48.0), (3, 52.0)):
    camera.lens = lens
    camera.keyframe_insert("lens", frame=frame)
action = camera.animation_data.action
curves = action.fcurves if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags[0].fcurves
for curve in curves:
    for point in curve.keyframe_points:
        point.interpolation = "LINEAR"
scene.frame_set(2)
if bpy.app.version < (5, 0, 0):
    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()
    shown = tree.nodes.new("CompositorNodeComposite")
else:
    tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    shown = tree.nodes.new("NodeGroupOutput")
tree.links.new(tree.nodes.new("CompositorNodeRLayers").outputs["Vector"], shown.inputs[0])
settings = scene.render.image_settings
if bpy.app.version >= (5, 0, 0):
    settings.media_type = "IMAGE"
settings.file_format, settings.color_depth = "OPEN_EXR", "32"
scene.render.filepath = sys.argv[1] + "/vector.exr"
bpy.ops.render.render(write_still=True)
image = bpy.data.images.load(scene.render.filepath)
image.colorspace_settings.is_data = True
pixels = np.empty(SIZE * SIZE * 4, np.float32)
image.pixels.foreach_get(pixels)
found = pixels.reshape(SIZE, SIZE, 4)[:, :, 0]
x = np.arange(SIZE) + 0.5 - SIZE / 2
slope = x / SIZE * 36.0 / 50.0
cosine = 1.0 / np.sqrt(1.0 + slope**2 + slope[:, None] ** 2)
right = -0.04 * x * np.ones((SIZE, 1))
far = np.abs(right) > 0.3
share = (found / right)[far]
mean = (share / cosine[far]).mean()
print(f"bpy {bpy.app.version_string}: at least {share.min():.3f} of it, {mean:.4f} of it times the cosine")
short = abs(mean - 1.0) < 0.003 and share.min() < 0.95
ok = short if bpy.app.version >= (5, 0, 0) else not found.any()
sys.stdout.flush()
os._exit(0 if ok else 1)
PYTHON
echo "as described"
