#!/usr/bin/env bash
# bpy 4.5.15 and 5.2.3: bpy.ops.render.render() answers FINISHED when the engine has failed, by error_set or by an
# exception in update() or render(); only report({"ERROR"}) becomes a RuntimeError.
#
# A render farm or a test that believes the operator's answer takes a black picture for a finished frame. Seen, both:
#    error_set: FINISHED     exception in render: FINISHED     report: RuntimeError     both: RuntimeError
# What it means here: engine.fail does both, and tests look at pixels.
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
timeout 300 "$folder/venv/bin/python" - 2>/dev/null <<'PYTHON'
import os

import bpy


class Failing(bpy.types.RenderEngine):
    bl_idname, bl_label = "FAILING", "Failing"
    how = ""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)

    def render(self, depsgraph):
        if self.how == "exception":
            raise ValueError("no picture")
        if self.how in ("error_set", "both"):
            self.error_set("no picture")
        if self.how in ("report", "both"):
            self.report({"ERROR"}, "no picture")


bpy.utils.register_class(Failing)
scene = bpy.context.scene
scene.render.engine = "FAILING"
scene.render.resolution_x = scene.render.resolution_y = 8
seen = {}
for how in ("error_set", "exception", "report", "both"):
    Failing.how = how
    try:
        seen[how] = next(iter(bpy.ops.render.render()))
    except RuntimeError:
        seen[how] = "RuntimeError"
bpy.utils.unregister_class(Failing)
print("bpy", bpy.app.version_string, seen, flush=True)
expected = {"error_set": "FINISHED", "exception": "FINISHED", "report": "RuntimeError", "both": "RuntimeError"}
os._exit(seen != expected)
PYTHON
echo "as described"
