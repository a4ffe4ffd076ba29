#!/usr/bin/env bash
# Cycles in bpy 4.5.15 and 5.2.3: with the Light Tree, a lamp that has a size lights surfaces whose normal map turns the
# normal far from the surface's own more than without it, unless its Multiple Importance is off. With one lamp alone
# there is nothing for the tree to choose: all four pictures should have one mean.
#
# A monkey of Diffuse BSDF whose Normal Map (Object Space) has one color, a point lamp of radius 0.2, no bounces. Seen,
# means over that without Light Tree (standard error below 0.001; the same on both versions):
#    Light Tree, Multiple Importance on:  1.024
#    Light Tree, Multiple Importance off: 1.00
#    no Light Tree, Multiple Importance off: 1.00
#    without the normal map, Light Tree, Multiple Importance on, over that without Light Tree: 1.00
# What it means here: ours has the mean of the others, as measured on that scene, so that materials with strong normal
# maps near wide lamps are darker by as much.
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
scene.cycles.max_bounces = 0
scene.cycles.light_sampling_threshold = 0.0
images = scene.render.image_settings
if hasattr(images, "media_type"):
    images.media_type = "IMAGE"
images.file_format, images.color_depth = "OPEN_EXR", "32"
scene.render.filepath = os.path.join(sys.argv[1], "picture.exr")


def lamp(kind, energy, location, **properties):
    item = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
    item.data.energy, item.location = energy, location
    for name, value in properties.items():
        setattr(item.data, name, value)
    scene.collection.objects.link(item)
    return item


material = bpy.data.materials.new("Bumped")
material.use_nodes = True
tree = material.node_tree
tree.nodes.clear()
diffuse, bumps = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeNormalMap")
bumps.space = "OBJECT"
bumps.inputs["Color"].default_value = (0.75, 0.35, 0.8, 1.0)
link = tree.links.new(bumps.outputs[0], diffuse.inputs["Normal"])
tree.links.new(diffuse.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
bpy.ops.mesh.primitive_monkey_add(size=1.8)
bpy.context.object.data.materials.append(material)
bpy.ops.object.shade_smooth()
point = lamp("POINT", 200.0, (1.5, -2.0, 2.0), shadow_soft_size=0.2)
point.visible_camera = False
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location, camera.rotation_euler.x = (0.0, -4.0, 0.0), 1.5708
scene.collection.objects.link(camera)
scene.camera = camera


def mean(light_tree=True, importance=True):
    scene.cycles.use_light_tree, point.data.cycles.use_multiple_importance_sampling = light_tree, importance
    found = []
    for seed in range(3):
        scene.cycles.seed = seed
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        values = np.empty(4 * SIZE * SIZE, np.float32)
        image.pixels.foreach_get(values)
        bpy.data.images.remove(image)
        found.append(values.reshape(-1, 4)[:, :3].mean())
    return float(np.mean(found))


without = mean(light_tree=False)
found = [mean() / without, mean(importance=False) / without, mean(False, False) / without]
tree.links.remove(link)
found.append(mean() / mean(light_tree=False))
print(bpy.app.version_string, [round(value, 4) for value in found], flush=True)
seen = [1.0236, 1.0, 1.0, 1.0]
os._exit(0 if all(abs(value - expected) < 0.004 for value, expected in zip(found, seen)) else 1)
PYTHON
echo "as seen"
