"""The installed extension: disable, enable, open a file, register twice; raises where something is left or missing."""

import sys

import addon_utils
import bpy

NAME = "bl_ext.user_default.restir_engine"


def registered() -> list[str]:
    """What the extension has in Blender."""
    names = [name for name in dir(bpy.types) if name.startswith("RESTIR_")]
    names += [name for name in ("Scene", "ViewLayer") if hasattr(getattr(bpy.types, name), "restir")]
    handlers = [h.__name__ for name in ("load_post", "render_init") for h in getattr(bpy.app.handlers, name)]
    return sorted([*names, *(name for name in handlers if name.startswith("restir"))])


before = registered()
assert len(before) > 10, before
assert "numba" not in sys.modules, "enabling must not import numba"
addon_utils.disable(NAME)
assert registered() == [], registered()
addon_utils.enable(NAME)
assert registered() == before
bpy.ops.wm.open_mainfile(filepath=sys.argv[-1])
assert registered() == before
sys.modules[NAME].register()
assert registered() == before
bpy.context.scene.render.engine = "RESTIR"
print("enabled again:", len(before), "things registered")
