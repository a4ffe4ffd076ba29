"""Small files for a farm to render, a monkey that turns before a wall, and what one machine makes of them."""

from __future__ import annotations

import textwrap
from pathlib import Path

import bpy

from .render import exact_files, quiet


def save(
    path: Path, size: int = 32, samples: int = 4, frames: int = 3, handler: str = "", composited: bool = False
) -> Path:
    """Save the open file, of one empty scene, with the monkey in it; pictures go to out/frame_ beside it, as EXR.

    handler: code that runs whenever a frame is entered, from a text that registers itself; in it `frame` is the frame's
    number. composited: the compositor inverts the picture, and a File Output node writes what was rendered to extra/.
    """
    scene = bpy.context.scene
    scene.render.engine = "RESTIR"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.restir.samples, scene.restir.integrator, scene.restir.is_initialized = samples, "PATH", True
    scene.frame_start, scene.frame_end = 1, frames
    scene.render.filepath = "//out/frame_"
    exact_files(scene)
    _stage(scene)
    if composited:
        _composite(scene)
    if handler:
        _handle(handler)
    with quiet():
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def animation(path: Path, folder: Path) -> None:
    """Render a file's frames as one machine does: what is written to //out goes to `folder`."""
    with quiet():
        bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=True)
        scene = bpy.context.scene
        scene.render.filepath = str(folder / "out" / "frame_")
        node = _output_node(scene)
        if node is not None:
            setattr(node, "directory" if hasattr(node, "directory") else "base_path", str(folder / "extra"))
        bpy.ops.render.render(animation=True)


def _stage(scene: bpy.types.Scene) -> None:
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    bpy.ops.mesh.primitive_monkey_add()
    monkey = bpy.context.object
    for frame, angle in ((1, 0.0), (11, 3.0)):
        monkey.rotation_euler = (0.0, 0.0, angle)
        monkey.keyframe_insert("rotation_euler", frame=frame)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 5.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler, sun.data.energy = (0.5, 0.3, 0.0), 3.0
    for item in (camera, sun):
        scene.collection.objects.link(item)
    scene.camera = camera


def _composite(scene: bpy.types.Scene) -> None:
    old = bpy.app.version < (5, 0, 0)
    if old:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        shown = tree.nodes.new("CompositorNodeComposite")
    else:
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        shown = tree.nodes.new("NodeGroupOutput")
    layers, invert = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeInvert")
    written = tree.nodes.new("CompositorNodeOutputFile")
    if not old:
        written.format.media_type = "IMAGE"
    written.format.file_format, written.format.color_depth = "OPEN_EXR", "32"
    if old:
        written.base_path = "//extra"
    else:
        written.directory, written.file_name = "//extra", "raw_"
        written.file_output_items.new("RGBA", "Image")
    tree.links.new(layers.outputs["Image"], invert.inputs["Color"])
    tree.links.new(invert.outputs["Color"], shown.inputs[0])
    tree.links.new(layers.outputs["Image"], written.inputs[0])


def _output_node(scene: bpy.types.Scene) -> bpy.types.Node | None:
    tree = scene.compositing_node_group if hasattr(scene, "compositing_node_group") else scene.node_tree
    nodes = tree.nodes if tree else ()
    return next((node for node in nodes if node.bl_idname == "CompositorNodeOutputFile"), None)


def _handle(code: str) -> None:
    text = bpy.data.texts.new("handler.py")
    text.use_module = True
    text.write("import bpy\n\n\ndef entered(scene, depsgraph=None):\n    frame = scene.frame_current\n")
    text.write(textwrap.indent(code, "    "))
    text.write("\n\n\nbpy.app.handlers.frame_change_pre.append(entered)\n")
