"""Pictures that Blender's compositor makes of a render's passes."""

import bpy
import numpy as np

from .render import quiet, read


def composited(scene, engine: str, wire, path) -> np.ndarray:
    """What the compositor shows: wire(nodes) → the socket to be shown. Float32 (height, width)."""
    if bpy.app.version < (5, 0, 0):
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        shown = tree.nodes.new("CompositorNodeComposite")
    else:
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        shown = tree.nodes.new("NodeGroupOutput")
    tree.links.new(wire(tree.nodes), shown.inputs[0])
    scene.render.engine, scene.render.filepath = engine, str(path / f"{engine}.exr")
    with quiet():
        bpy.ops.render.render(write_still=True)
    return read(scene.render.filepath)[:, :, 0]
