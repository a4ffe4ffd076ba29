#!/usr/bin/env bash
# Scripted bakes (`bpy.ops.object.bake`) with an engine of one's own in bpy 4.5.15 and 5.2.3: nothing tells the engine's
# `update` that what follows is `bake` and not `render`.
#  - The handlers object_bake_pre, object_bake_complete and object_bake_cancel are not called; render_init and
#    render_complete are, by renders alone.
#  - `engine.resolution_x` is 0 in `update` before the first render of a session, and after it that render's width, with
#    whatever is baked.
#
# Seen, both: a bake: update with 0; a render of 32 pixels: render_init, update with 32, render_complete; the same bake
# again: update with 32
# What it means here: engine.py knows by render_init and its like whether a picture is asked for.
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
timeout 600 "$folder/venv/bin/python" - 2>/dev/null <<'PYTHON'
import os

import bpy

log = []


class Witness(bpy.types.RenderEngine):
    bl_idname = bl_label = "WITNESS"

    def update(self, data, depsgraph):
        log.append(self.resolution_x)

    def render(self, depsgraph):
        pass

    def bake(self, depsgraph, item, kind, parts, width, height):
        self.end_result(self.begin_result(0, 0, width, height, layer="Layer"))


bpy.utils.register_class(Witness)
bpy.ops.wm.read_factory_settings(use_empty=True)
for name in ("object_bake_pre", "object_bake_complete", "object_bake_cancel", "render_init", "render_complete"):
    getattr(bpy.app.handlers, name).append(lambda *_, name=name: log.append(name))
scene = bpy.context.scene
scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "WITNESS", 32, 32
scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
scene.collection.objects.link(scene.camera)
bpy.ops.mesh.primitive_cube_add()
material = bpy.data.materials.new("Material")
if bpy.app.version < (5, 0, 0):
    material.use_nodes = True
node = material.node_tree.nodes.new("ShaderNodeTexImage")
node.image = bpy.data.images.new("Image", 16, 16)
material.node_tree.nodes.active = node
bpy.context.object.data.materials.append(material)


def said(operator, **settings):
    log.clear()
    operator(**settings)
    print(f"bpy {bpy.app.version_string}, {operator.idname_py()}: {log}", flush=True)
    return list(log)


first = said(bpy.ops.object.bake, type="EMIT")
picture = said(bpy.ops.render.render)
second = said(bpy.ops.object.bake, type="EMIT")
os._exit(not (first == [0] and picture == ["render_init", 32, "render_complete"] and second == [32]))
PYTHON
echo "as described"
