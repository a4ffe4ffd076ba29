#!/usr/bin/env bash
# Cycles in bpy 4.5.15 and 5.2.3: Max Bounces of a lamp limits only what light sampling finds. Rays that meet the lamp
# bring what multiple importance gives them at any bounce, so that the light of a lamp with Max Bounces 0 depends on its
# Multiple Importance and, with it, on other lamps, those in a closed box too: they lower the chance that it is sampled,
# by which the rays' part is weighed. Max Bounces of a world of one color has no effect at all.
#
# A floor and a cube of Glossy (roughness 0.3), an area lamp of Max Bounces 0, 4 bounces. Seen, means over that with
# Multiple Importance off (standard error about 0.003; the same on both versions):
#    with Multiple Importance: 1.45
#    with Multiple Importance and eight lamps in a closed box: 1.50
# and a world of one color with Max Bounces 0, no lamp, over that with 1024: 1.00
# What it means here: ours does the same with our own chances (docs/path-tracing.md, scene limits_of_lamps), so that
# glossy surfaces beyond the limit of one lamp among several can differ.
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
scene.cycles.max_bounces = scene.cycles.glossy_bounces = 4
scene.cycles.blur_glossy = 0.0
scene.cycles.light_sampling_threshold = 0.0
images = scene.render.image_settings
if hasattr(images, "media_type"):
    images.media_type = "IMAGE"
images.file_format, images.color_depth = "OPEN_EXR", "32"
scene.render.filepath = os.path.join(sys.argv[1], "picture.exr")


def material(kind, **inputs):
    made = bpy.data.materials.new(kind)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    node = tree.nodes.new(kind)
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def lamp(kind, energy, location, **properties):
    item = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
    item.data.energy, item.location = energy, location
    for name, value in properties.items():
        setattr(item.data, name, value)
    scene.collection.objects.link(item)
    return item


glossy = material("ShaderNodeBsdfGlossy", Color=(0.8, 0.8, 0.8, 1.0), Roughness=0.3)
bpy.ops.mesh.primitive_plane_add(size=6.0)
bpy.context.object.data.materials.append(glossy)
bpy.ops.mesh.primitive_cube_add(size=2.0, location=(0.0, 1.5, 1.0))
bpy.context.object.data.materials.append(glossy)
area = lamp("AREA", 200.0, (0.0, -1.0, 3.0), size=1.0)
area.data.cycles.max_bounces = 0
bpy.ops.mesh.primitive_cube_add(size=0.4, location=(-1.5, -0.5, 0.6))
bpy.context.object.data.materials.append(material("ShaderNodeBsdfDiffuse", Color=(0.0, 0.0, 0.0, 1.0)))
boxed = [lamp("POINT", 200.0, (-1.5, -0.5, 0.5 + 0.02 * i), shadow_soft_size=0.01) for i in range(8)]
world = scene.world = bpy.data.worlds.new("World")
world.use_nodes = True
background = world.node_tree.nodes["Background"]
background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location, camera.rotation_euler.x = (0.0, -6.0, 2.0), 1.4
scene.collection.objects.link(camera)
scene.camera = camera


def mean(importance=True, boxes=False, lamps=True, world_bounces=1024):
    area.data.cycles.use_multiple_importance_sampling, area.hide_render = importance, not lamps
    for item in boxed:
        item.hide_render = not boxes
    background.inputs["Strength"].default_value = 0.0 if lamps else 0.5
    world.cycles.max_bounces = world_bounces
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


off = mean(False)
found = [mean() / off, mean(boxes=True) / off, mean(lamps=False, world_bounces=0) / mean(lamps=False)]
print(bpy.app.version_string, [round(value, 4) for value in found], flush=True)
seen = [1.448, 1.502, 1.0]
os._exit(0 if all(abs(value - expected) < 0.012 for value, expected in zip(found, seen)) else 1)
PYTHON
echo "as seen"
