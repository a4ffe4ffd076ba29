#!/usr/bin/env bash
# Cycles in bpy 4.5.15 and 5.2.3: the mean of a picture of rough glass depends on whether the world is sampled. With
# World > Settings > Sampling Method at "None", light is found by the BSDF's directions alone, with "Auto" by those of the
# light as well; both should have one mean. Lobes that refract also answer for directions that they never sample.
#
# A cube of Glass (GGX, Multiscatter GGX) alone under a picture of the sky with one bright rectangle. Seen, mean with
# "Auto" over mean with "None" (standard error below 0.01; the same on both versions):
#    GGX, IOR 1.8:               1.00 at roughness 0.2, 1.06 at 0.5, 1.70 at 1
#    Multiscatter GGX, IOR 1.8:  1.01 at roughness 0.2, 1.26 at 0.5, 2.95 at 1
# What it means here: under a sampled world or a lamp, glass of a high roughness is brighter in Cycles than in ours,
# which has the mean of "None" in either way (docs/lobes.md, tests/unit/test_lobes_sampling.py).
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
timeout 1200 "$folder/venv/bin/python" - "$folder" 2>/dev/null <<'PYTHON'
import os
import sys

import bpy
import numpy as np

SIZE = 32
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples = "CYCLES", 256
scene.render.resolution_x = scene.render.resolution_y = SIZE
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
scene.cycles.blur_glossy = 0.0
scene.cycles.max_bounces = scene.cycles.glossy_bounces = scene.cycles.transmission_bounces = 16
images = scene.render.image_settings
if hasattr(images, "media_type"):
    images.media_type = "IMAGE"
images.file_format, images.color_depth = "OPEN_EXR", "32"

sky = bpy.data.images.new("Sky", 64, 32, float_buffer=True)
pixels = np.zeros((32, 64, 4), np.float32) + np.array([0.0, 0.0, 0.0, 1.0], np.float32)
pixels[18:30, 8:40, :3] = 10.0
sky.pixels.foreach_set(pixels.ravel())
world = scene.world = bpy.data.worlds.new("World")
world.use_nodes = True
background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
picture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
picture.image = sky
world.node_tree.links.new(picture.outputs["Color"], background.inputs["Color"])

bpy.ops.mesh.primitive_cube_add(rotation=(0.4, 0.5, 0.6))
material = bpy.data.materials.new("Glass")
bpy.context.object.data.materials.append(material)
material.use_nodes = True
tree = material.node_tree
tree.nodes.clear()
glass = tree.nodes.new("ShaderNodeBsdfGlass")
glass.inputs["IOR"].default_value = 1.8
tree.links.new(glass.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.data.lens, camera.location = 60.0, (0.0, 0.0, 6.0)
scene.collection.objects.link(camera)
scene.camera = camera


def mean(method, seed):
    world.cycles.sampling_method, scene.cycles.seed = method, seed
    scene.render.filepath = os.path.join(sys.argv[1], "picture.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    values = np.empty(4 * SIZE * SIZE, np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values.reshape(-1, 4)[:, :3].mean()


def ratio(distribution, roughness):
    glass.distribution, glass.inputs["Roughness"].default_value = distribution, roughness
    auto, none = (np.mean([mean(method, seed) for seed in range(2)]) for method in ("AUTOMATIC", "NONE"))
    return auto / none


found = {(kind, rough): ratio(kind, rough) for kind in ("GGX", "MULTI_GGX") for rough in (0.2, 0.5, 1.0)}
print(bpy.app.version_string, {key: round(float(value), 3) for key, value in found.items()}, flush=True)
seen = {("GGX", 0.2): 1.0, ("GGX", 0.5): 1.06, ("GGX", 1.0): 1.70}
seen |= {("MULTI_GGX", 0.2): 1.01, ("MULTI_GGX", 0.5): 1.26, ("MULTI_GGX", 1.0): 2.95}
os._exit(0 if all(abs(found[key] / value - 1.0) < 0.03 for key, value in seen.items()) else 1)
PYTHON
echo "as seen"
