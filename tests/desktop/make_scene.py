"""Save a small Cycles scene of three frames, to be rendered with `-E RESTIR`."""

import sys

import bpy

scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.diffuse_bounces = 16, False, 3
scene.render.resolution_x, scene.render.resolution_y = 240, 160
scene.frame_start, scene.frame_end = 1, 3
scene.render.image_settings.file_format = "PNG"
cube = bpy.data.objects["Cube"]
cube.keyframe_insert("rotation_euler", frame=1)
cube.rotation_euler.z = 1.0
cube.keyframe_insert("rotation_euler", frame=3)
bpy.ops.mesh.primitive_plane_add(size=12.0, location=(0.0, 0.0, -1.0))
bpy.ops.mesh.primitive_monkey_add(location=(2.2, -1.6, 0.0), rotation=(0.0, 0.0, 0.6))
material = bpy.data.materials.new("Copper")
if bpy.app.version < (5, 0, 0):
    material.use_nodes = True
principled = next(node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
principled.inputs["Base Color"].default_value = (0.8, 0.35, 0.2, 1.0)
principled.inputs["Metallic"].default_value, principled.inputs["Roughness"].default_value = 1.0, 0.25
bpy.context.object.data.materials.append(material)
bpy.ops.wm.save_as_mainfile(filepath=bpy.path.abspath(sys.argv[-1]) if sys.argv[-1].startswith("//") else sys.argv[-1])
