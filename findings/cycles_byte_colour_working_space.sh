#!/usr/bin/env bash
# Cycles in bpy 5.2.3: a Byte Color attribute is converted to the file's working space where its domain is Face Corner,
# and not where it is Vertex. In a file whose working space is ACEScg the same bytes are two colours; in one of Linear
# Rec.709 they are one.
#
# Two planes emit an attribute each, of the bytes of (0.8, 0.2, 0.1) in sRGB, in a file of either working space. Seen,
# the largest difference of a channel of both, in the working space:
#    Linear Rec.709: below 0.0001
#    ACEScg: 0.22
# What it means here: ours converts like Cycles, corners and not vertices (tests/blender/test_working_space.py).
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

SIZE = 16
DOMAINS = ("POINT", "CORNER")


def seen(space):
    """What a camera sees of the attribute of each domain, in a file of a working space."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.set_working_color_space(working_space=space, convert_colors=False)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x, scene.render.resolution_y = 2 * SIZE, SIZE
    scene.cycles.use_denoising = False
    images = scene.render.image_settings
    images.media_type, images.file_format, images.color_depth = "IMAGE", "OPEN_EXR", "32"
    images.color_management = "OVERRIDE"
    images.linear_colorspace_settings.name = space
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location.z = "ORTHO", 4.0, 2.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    for index, domain in enumerate(DOMAINS):
        bpy.ops.mesh.primitive_plane_add(size=2.0, location=(2.0 * index - 1.0, 0.0, 0.0))
        mesh = bpy.context.object.data
        attribute = mesh.color_attributes.new("Paint", "BYTE_COLOR", domain)
        attribute.data.foreach_set("color_srgb", np.tile([0.8, 0.2, 0.1, 1.0], len(attribute.data)))
        material = bpy.data.materials.new(domain)
        mesh.materials.append(material)
        tree = material.node_tree
        tree.nodes.clear()
        paint, light = tree.nodes.new("ShaderNodeVertexColor"), tree.nodes.new("ShaderNodeEmission")
        paint.layer_name = "Paint"
        tree.links.new(paint.outputs["Color"], light.inputs["Color"])
        tree.links.new(light.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    scene.render.filepath = os.path.join(sys.argv[1], "picture.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = space
    values = np.empty(8 * SIZE * SIZE, np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(SIZE, 2 * SIZE, 4)[SIZE // 2, :, :3]
    return values[SIZE // 2], values[3 * SIZE // 2]


found = {}
for space in ("Linear Rec.709", "ACEScg"):
    vertices, corners = seen(space)
    found[space] = float(np.abs(vertices - corners).max())
    print(space, "vertices", vertices.round(4), "corners", corners.round(4), flush=True)
os._exit(0 if found["Linear Rec.709"] < 1e-4 and abs(found["ACEScg"] - 0.22) < 0.03 else 1)
PYTHON
echo "as seen"
