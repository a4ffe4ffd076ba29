#!/usr/bin/env bash
# Cycles in bpy 4.5.15 and 5.2.3: a point lamp that has a radius and stands inside of a scattering volume gives less
# light where its Multiple Importance is on than where it is off. Both should have one mean; outside of volumes, and
# without a radius, they have.
#
# A cube of Volume Scatter (density 1) with a lamp inside, not seen by the camera, eight bounces. Seen, mean with Multiple
# Importance over mean without (standard error about 0.003; the same on both versions):
#    Soft Falloff off: 0.96
#    Soft Falloff on:  0.985
#    the same lamps without a volume, over a floor: 1.00
# What it means here: ours has the mean of "off" in either way (docs/media.md, scene volume_lamp_inside).
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
timeout 900 "$folder/venv/bin/python" - "$folder" 2>/dev/null <<'PYTHON'
import os
import sys

import bpy
import numpy as np

SIZE = 48
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples = "CYCLES", 256
scene.render.resolution_x = scene.render.resolution_y = SIZE
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
scene.cycles.max_bounces = scene.cycles.volume_bounces = 8
images = scene.render.image_settings
if hasattr(images, "media_type"):
    images.media_type = "IMAGE"
images.file_format, images.color_depth = "OPEN_EXR", "32"
scene.render.filepath = os.path.join(sys.argv[1], "picture.exr")

material = bpy.data.materials.new("Fog")
material.use_nodes = True
tree = material.node_tree
tree.nodes.clear()
scatter = tree.nodes.new("ShaderNodeVolumeScatter")
scatter.inputs["Density"].default_value = 1.0
scatter.inputs["Color"].default_value = (0.8, 0.8, 0.8, 1.0)
tree.links.new(scatter.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
bpy.ops.mesh.primitive_cube_add(size=1.9)
fog = bpy.context.object
fog.data.materials.append(material)
bpy.ops.mesh.primitive_plane_add(size=6.0, location=(0.0, 0.0, -1.0))
lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
lamp.data.energy, lamp.data.shadow_soft_size, lamp.location = 60.0, 0.15, (0.2, 0.1, 0.1)
lamp.visible_camera = False
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location, camera.rotation_euler.x = (0.0, -6.0, 0.5), 1.49
for item in (lamp, camera):
    scene.collection.objects.link(item)
scene.camera = camera


def mean(multiple_importance, seed):
    lamp.data.cycles.use_multiple_importance_sampling, scene.cycles.seed = multiple_importance, seed
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    values = np.empty(4 * SIZE * SIZE, np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values.reshape(-1, 4)[:, :3].mean()


def ratio(soft, in_fog):
    lamp.data.use_soft_falloff, fog.hide_render = soft, not in_fog
    on, off = (np.mean([mean(value, seed) for seed in range(3)]) for value in (True, False))
    return float(on / off)


found = {(soft, in_fog): ratio(soft, in_fog) for in_fog in (True, False) for soft in (False, True)}
print(bpy.app.version_string, {key: round(value, 4) for key, value in found.items()}, flush=True)
seen = {(False, True): 0.96, (True, True): 0.985, (False, False): 1.0, (True, False): 1.0}
os._exit(0 if all(abs(found[key] - value) < 0.012 for key, value in seen.items()) else 1)
PYTHON
echo "as seen"
