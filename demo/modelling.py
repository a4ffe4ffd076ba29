"""What the demo scenes are made with: materials, turned and boxed objects, a world and a camera, all through bpy.

Lengths are metres; profiles are (radius, height) in centimetres; colours are sRGB hex codes.
"""

import math
from pathlib import Path

import bpy
from mathutils import Vector

# Patterns: texture node, its settings by input name.
PATTERNS = {
    "grain": ("ShaderNodeTexNoise", {"Scale": 4.0, "Detail": 9.0, "Roughness": 0.62, "Distortion": 0.7}),
    "cloud": ("ShaderNodeTexNoise", {"Scale": 1.0, "Detail": 6.0, "Roughness": 0.6, "Distortion": 0.3}),
    "fine": ("ShaderNodeTexNoise", {"Scale": 1.0, "Detail": 2.0, "Roughness": 0.6}),
    "peel": ("ShaderNodeTexNoise", {"Scale": 1.0, "Detail": 2.0, "Roughness": 0.4}),
    "hammer": ("ShaderNodeTexVoronoi", {"Scale": 1.0, "Randomness": 0.8}),
}


def subsurface(weight: float, radius: tuple[float, float, float], scale: float) -> dict:
    """Inputs of Principled: the share of light that goes below the surface, and its mean free paths in metres."""
    return {"Subsurface Weight": weight, "Subsurface Radius": radius, "Subsurface Scale": scale}


def rgba(code: str) -> tuple[float, float, float, float]:
    """Scene-linear colour of an sRGB hex code."""
    channels = [int(code[i : i + 2], 16) / 255 for i in (0, 2, 4)]
    return (*[c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels], 1.0)


def material(name: str, inputs: dict, pattern: tuple | None) -> bpy.types.Material:
    """A Principled material from one row of `MATERIALS`."""
    result = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        result.use_nodes = True
    nodes, links = result.node_tree.nodes, result.node_tree.links
    principled = next(node for node in nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    for key, value in inputs.items():
        principled.inputs[key].default_value = rgba(value) if isinstance(value, str) else value
    if pattern is None:
        return result
    kind, colours, scale, strength = pattern
    coordinates, mapping = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    texture, ramp = nodes.new(PATTERNS[kind][0]), nodes.new("ShaderNodeValToRGB")
    mapping.inputs["Scale"].default_value = scale
    for key, value in PATTERNS[kind][1].items():
        texture.inputs[key].default_value = value
    for i, colour in enumerate(colours):
        position = 0.28 + 0.44 * i / (len(colours) - 1)
        element = ramp.color_ramp.elements[i] if i < 2 else ramp.color_ramp.elements.new(position)
        element.position, element.color = position, rgba(colour)
    links.new(coordinates.outputs["Object"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs[0], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], principled.inputs["Base Color"])
    if strength:
        bump = nodes.new("ShaderNodeBump")
        bump.inputs["Strength"].default_value, bump.inputs["Distance"].default_value = strength, 0.002
        links.new(texture.outputs[0], bump.inputs["Height"])
        links.new(bump.outputs["Normal"], principled.inputs["Normal"])
    return result


def mesh_object(name, vertices, edges, faces, surface, location=(0, 0, 0), rotation=(0, 0, 0)) -> bpy.types.Object:
    """A smooth object of the scene from lists of vertices, edges and faces."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, edges, faces)
    mesh.materials.append(surface)
    mesh.shade_smooth()
    result = bpy.data.objects.new(name, mesh)
    result.location, result.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(result)
    return result


def turned(name, profile, surface, location, rotation=(0, 0, 0), scale=1.0) -> bpy.types.Object:
    """A profile turned about the vertical axis and smoothed."""
    points = [(scale * 0.01 * r, 0.0, scale * 0.01 * z) for r, z in profile]
    edges = [(i, i + 1) for i in range(len(points) - 1)]
    result = mesh_object(name, points, edges, [], surface, location, rotation)
    screw = result.modifiers.new("Turn", "SCREW")
    screw.steps = screw.render_steps = 24
    screw.merge_threshold = 1e-6
    screw.use_merge_vertices, screw.use_smooth_shade, screw.use_normal_calculate = True, True, True
    smooth = result.modifiers.new("Smooth", "SUBSURF")
    smooth.levels = smooth.render_levels = 3
    return result


def box(name, size, surface, location, rotation=(0, 0, 0), bevel=0.002) -> bpy.types.Object:
    """A box with rounded edges, its centre at `location`."""
    x, y, z = (0.5 * s for s in size)
    corners = [(i, j, k) for i in (-x, x) for j in (-y, y) for k in (-z, z)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    result = mesh_object(name, corners, [], faces, surface, location, rotation)
    rounding = result.modifiers.new("Rounding", "BEVEL")
    rounding.width, rounding.segments = bevel, 4
    return result


def interior(scene: bpy.types.Scene, turn: float, strength: float) -> None:
    """Light the scene by one of Blender's own HDRIs, turned by degrees, its radiance times `strength`."""
    world = scene.world = bpy.data.worlds.new("Interior")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = next(node for node in nodes if node.bl_idname == "ShaderNodeBackground")
    coordinates, mapping = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    environment = nodes.new("ShaderNodeTexEnvironment")
    folder = Path(bpy.utils.system_resource("DATAFILES")) / "studiolights" / "world"
    environment.image = bpy.data.images.load(str(folder / "interior.exr"))
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, math.radians(turn))
    background.inputs["Strength"].default_value = strength
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], environment.inputs["Vector"])
    links.new(environment.outputs["Color"], background.inputs["Color"])


def look(scene: bpy.types.Scene, eye, target, focus, lens: float, fstop: float) -> None:
    """A camera at `eye` that looks at `target`, focused on the distance of `focus`; its lens in millimetres."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.dof.use_dof, data.dof.aperture_fstop, data.dof.aperture_blades = lens, True, fstop, 7
    result = scene.camera = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(result)
    eye, target = Vector(eye), Vector(target)
    result.location, result.rotation_euler = eye, (target - eye).to_track_quat("-Z", "Y").to_euler()
    data.dof.focus_distance = (Vector(focus) - eye).length


def develop(scene: bpy.types.Scene, width: int, height: int) -> None:
    """Size of the picture, and its view transform."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"
    scene.view_settings.exposure = 0.0
