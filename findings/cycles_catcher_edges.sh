#!/usr/bin/env bash
# Cycles in bpy 4.5.15 and 5.2.3: where an object stands before a shadow catcher and the world is visible, the object's
# antialiased edge is darker than both sides of it: what it covers of a pixel is taken off the world twice.
#
# A white luminous square, which casts no shadow and which nothing but the camera sees, before a catcher, before a white
# world: all is 1. Seen, both: the least pixel 0.75, where the square covers half (0.5 + 0.5 · 0.5 · 1); 1.00 where
# the catcher is no catcher but as luminous as the rest.
# What it means here: such edges are dark as well (docs/shadow-catchers.md); compositors use a transparent film.
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

SIZE = 64
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.render.resolution_x, scene.render.resolution_y = SIZE, SIZE
scene.view_settings.view_transform = "Raw"
scene.cycles.samples, scene.cycles.use_adaptive_sampling = 256, False
images = scene.render.image_settings
if bpy.app.version >= (5, 0, 0):
    images.media_type = "IMAGE"
images.file_format, images.color_depth = "OPEN_EXR", "32"
scene.world = bpy.data.worlds.new("World")
if bpy.app.version < (5, 0, 0):
    scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
camera = bpy.data.cameras.new("Camera")
camera.type, camera.ortho_scale = "ORTHO", 2.0
scene.camera = bpy.data.objects.new("Camera", camera)
scene.camera.location.z = 4.0
scene.collection.objects.link(scene.camera)
white = bpy.data.materials.new("White")
if bpy.app.version < (5, 0, 0):
    white.use_nodes = True
tree = white.node_tree
tree.nodes.clear()
light = tree.nodes.new("ShaderNodeEmission")
light.inputs["Color"].default_value = (1, 1, 1, 1)
tree.links.new(light.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
bpy.ops.mesh.primitive_plane_add(size=1.03, location=(0, 0, 1))
square = bpy.context.object
square.data.materials.append(white)
square.rotation_euler.z = 0.4
for kind in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
    setattr(square, f"visible_{kind}", False)
bpy.ops.mesh.primitive_plane_add(size=4.0)
floor = bpy.context.object


def least(catcher):
    floor.is_shadow_catcher = catcher
    if not catcher:
        floor.data.materials.append(white)
    scene.render.filepath = os.path.join(sys.argv[1], "picture.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(4 * SIZE * SIZE, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    found = float(pixels.reshape(-1, 4)[:, 0].min())
    print(f"bpy {bpy.app.version_string}, shadow catcher {catcher}: the least pixel {found:.3f}", flush=True)
    return found


os._exit(not (abs(least(True) - 0.75) < 0.01 and abs(least(False) - 1.0) < 0.001))
PYTHON
echo "as described"
