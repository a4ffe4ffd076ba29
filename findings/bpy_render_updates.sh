#!/usr/bin/env bash
# bpy 4.5.15 and 5.2.3: in an animation render, depsgraph.updates tells an engine what has changed only with Persistent
# Data; without it every frame has a new engine and a new depsgraph, in which everything counts as changed.
#
# Two cubes, one of which moves; engine instances and objects flagged in update() over frames 1 to 3. Seen, both:
#    without: 3 engines; both cubes with geometry and transform in every frame
#    with:    1 engine; from frame 2 on the moved cube alone, its transform alone
# What it means here: meshes kept from frame to frame are found by what they hold, and belong to the engine's class.
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
timeout 300 "$folder/venv/bin/python" - "$folder" 2>/dev/null <<'PYTHON'
import os
import sys

import bpy

SEEN = []


class Watching(bpy.types.RenderEngine):
    bl_idname, bl_label = "WATCHING", "Watching"

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.number = next(COUNT)

    def update(self, data, depsgraph):
        cubes = {
            update.id.name: (update.is_updated_geometry, update.is_updated_transform)
            for update in depsgraph.updates
            if update.id.name in ("Still", "Moving") and isinstance(update.id, bpy.types.Object)
        }
        SEEN.append((self.number, cubes))

    def render(self, depsgraph):
        self.end_result(self.begin_result(0, 0, 8, 8))


COUNT = iter(range(100))
bpy.utils.register_class(Watching)
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "WATCHING"
scene.render.resolution_x = scene.render.resolution_y = 8
scene.render.filepath = os.path.join(sys.argv[1], "frame_")
scene.frame_start, scene.frame_end = 1, 3
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
scene.collection.objects.link(camera)
scene.camera = camera
for name in ("Still", "Moving"):
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.name = name
thing = bpy.data.objects["Moving"]
for frame in (1, 3):
    thing.location.x = frame
    thing.keyframe_insert("location", frame=frame)
results = {}
for persistent in (False, True):
    scene.render.use_persistent_data = persistent
    SEEN.clear()
    bpy.ops.render.render(animation=True)
    results[persistent] = len({number for number, _ in SEEN}), [cubes for _, cubes in SEEN]
    print(f"bpy {bpy.app.version_string}, Persistent Data {persistent}: {results[persistent]}", flush=True)
bpy.utils.unregister_class(Watching)
both = {"Still": (True, True), "Moving": (True, True)}
as_described = results[False] == (3, [both] * 3) and results[True][0] == 1
as_described &= results[True][1][1:] == [{"Moving": (False, True)}] * 2
os._exit(not as_described)
PYTHON
echo "as described"
