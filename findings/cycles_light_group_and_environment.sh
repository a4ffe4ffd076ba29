#!/usr/bin/env bash
# Cycles in bpy 4.5.15 and 5.2.3: with a transparent film, what a light group's pass shows depends on whether the
# Environment pass is asked for. With it the world that the film lets through is in the pass of the world's group, which
# then is no part of Combined: groups do not add up to it. Without it they do.
#
# A grey ball before a world that is in the group "sky", all light there is. Seen, both: the mean of Combined_sky over
# Combined's
#    without the Environment pass: 1.00
#    with it:                      2.5 or more (where the picture shows world, 0 in Combined)
# What it means here: passes of light groups do the same (kernels/film/contribute.py, wants_backdrop).
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
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check "bpy==$version" "OpenEXR==3.4.2"
timeout 600 "$folder/venv/bin/python" - "$folder" 2>/dev/null <<'PYTHON'
import os
import sys

import bpy
import OpenEXR

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.render.resolution_x, scene.render.resolution_y = 64, 64
scene.render.film_transparent = True
scene.cycles.samples, scene.cycles.use_adaptive_sampling = 64, False
images = scene.render.image_settings
if bpy.app.version >= (5, 0, 0):
    images.media_type = "MULTI_LAYER_IMAGE"
images.file_format, images.color_depth = "OPEN_EXR_MULTILAYER", "32"
scene.world = bpy.data.worlds.new("World")
if bpy.app.version < (5, 0, 0):
    scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
layer = bpy.context.view_layer
layer.lightgroups.add(name="sky")
scene.world.lightgroup = "sky"
scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
scene.camera.location.z = 6.0
scene.collection.objects.link(scene.camera)
bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)


def ratio(environment):
    layer.use_pass_environment = environment
    scene.render.filepath = os.path.join(sys.argv[1], f"picture{environment:d}.exr")
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(scene.render.filepath, separate_channels=True) as file:
        found = [part.channels[name].pixels for part in file.parts for name in part.channels if ".Combined" in name]
        names = [name for part in file.parts for name in part.channels if ".Combined" in name]
    means = {name.split(".", 1)[1]: float(each.mean()) for name, each in zip(names, found, strict=True)}
    result = means["Combined_sky.R"] / means["Combined.R"]
    print(f"bpy {bpy.app.version_string}, Environment pass {environment}: {result:.3f}", flush=True)
    return result


without, beside = ratio(False), ratio(True)
os._exit(not (abs(without - 1.0) < 0.001 and beside > 2.0))
PYTHON
echo "as described"
