#!/usr/bin/env bash
# Cycles in bpy 4.5.15 and 5.2.3: with light linking and the light tree (its default) light does not add up: where a
# lamp is linked, and an emissive mesh and another lamp light the same thing, that is more than a quarter too bright. Without
# the light tree light adds up.
#
# A white ball, which an area lamp is linked to, a point lamp, an emissive face, no bounces: the picture with all three
# beside (lamp and point) + (lamp and face) - (lamp), which is the same light. Seen, both:
#    light tree on:  all three by the sum of the parts 1.28
#    light tree off: 1.00
# What it means here: pictures with light linking are compared with Cycles without its light tree
# (testing/blender/scenes/light.py); artists who compare the two engines may find Cycles brighter.
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
from mathutils import Vector

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.render.resolution_x, scene.render.resolution_y = 64, 64
scene.view_settings.view_transform = "Raw"
scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.max_bounces = 256, False, 0
scene.cycles.light_sampling_threshold = 0.0
images = scene.render.image_settings
if bpy.app.version >= (5, 0, 0):
    images.media_type = "IMAGE"
images.file_format, images.color_depth = "OPEN_EXR", "32"


def add(data, location):
    thing = bpy.data.objects.new(data.name, data)
    thing.location = location
    thing.rotation_euler = (Vector((0, 0, 0)) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(thing)
    return thing


def surface(kind, **inputs):
    material = bpy.data.materials.new(kind)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        shader.inputs[name].default_value = value
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


scene.camera = add(bpy.data.cameras.new("Camera"), (0, -5, 1))
bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
ball = bpy.context.object
ball.data.materials.append(surface("BsdfDiffuse", Color=(1, 1, 1, 1)))
lamp = add(bpy.data.lights.new("Area", "AREA"), (-2.5, -2, 2.5))
lamp.data.energy, lamp.data.size = 150, 0.8
point = add(bpy.data.lights.new("Point", "POINT"), (3, -1.5, 2))
point.data.energy, point.data.shadow_soft_size = 100, 0.4
bpy.ops.mesh.primitive_plane_add(size=1, location=(0, -1, 3))
face = bpy.context.object
face.data.materials.append(surface("Emission", Strength=15.0))
linked = bpy.data.collections.new("linked")
linked.objects.link(ball)
lamp.light_linking.receiver_collection = linked


def light(*lights):
    """The mean of the ball's right half, away from the linked lamp."""
    for thing in (point, face):
        thing.hide_render = thing not in lights
    scene.render.filepath = os.path.join(sys.argv[1], "picture.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(4 * 64 * 64, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return float(pixels.reshape(64, 64, 4)[20:44, 34:44, 0].mean())


ratios = {}
for tree in (True, False):
    scene.cycles.use_light_tree = tree
    ratios[tree] = light(point, face) / (light(point) + light(face) - light())
    print(f"bpy {bpy.app.version_string}, light tree {tree}: {ratios[tree]:.3f}", flush=True)
os._exit(not (ratios[True] > 1.03 and abs(ratios[False] - 1.0) < 0.01))
PYTHON
echo "as described"
