"""Motion blur: cameras, objects, instances and meshes that move while the shutter is open."""

import math

import bpy
import numpy as np

from .. import kit
from ..registry import scene
from .strands import groom


def keyed(owner, path: str, values: dict[float, object], interpolation: str = "LINEAR") -> None:
    """Let a property have these values at these frames."""
    for frame, value in values.items():
        setattr(owner, path, value)
        owner.keyframe_insert(path, frame=frame)
    action = owner.id_data.animation_data.action
    curves = action.fcurves if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags[0].fcurves
    for curve in curves:
        for point in curve.keyframe_points:
            point.interpolation = interpolation


def shutter(length: float = 1.0, position: str = "CENTER", curve=None) -> None:
    """Switch motion blur on, at frame 2. curve: (place, height) pairs of the shutter's curve."""
    scene = bpy.context.scene
    scene.frame_set(2)
    render = scene.render
    render.use_motion_blur = True
    render.motion_blur_shutter, render.motion_blur_position = length, position
    if curve:
        mapping = render.motion_blur_shutter_curve
        points = mapping.curves[0].points
        while len(points) > 2:
            points.remove(points[1])
        for point, place in zip(points, (curve[0], curve[-1]), strict=True):
            point.location = place
        for place in curve[1:-1]:
            points.new(*place)
        for point in points:
            point.handle_type = "VECTOR"
        mapping.update()


def sliding(thing, way=(1.5, 0.0, 0.0)) -> None:
    """Let an object go along a way from frame 1 to frame 3."""
    x, y, z = thing.location
    keyed(thing, "location", {1: (x - way[0], y - way[1], z - way[2]), 3: (x + way[0], y + way[1], z + way[2])})


def spinning(thing, degrees: float, axis: int = 1) -> None:
    """Let an object turn so far from frame 1 to frame 3."""
    angles = [[0.0] * 3, [0.0] * 3]
    angles[0][axis], angles[1][axis] = -math.radians(degrees) / 2, math.radians(degrees) / 2
    keyed(thing, "rotation_euler", {1: angles[0], 3: angles[1]})


def bench() -> None:
    """A floor, a lamp, and a faint sky."""
    kit.floor()
    kit.lamp()
    kit.world(lambda node: node("Background", Strength=0.3))


@scene(1, deep=True)
def moving_camera():
    """A camera that pans and comes nearer while its lens gets longer."""
    bench()
    kit.row([kit.diffuse((0.8, 0.3, 0.2)), kit.diffuse((0.2, 0.6, 0.3)), kit.emission((0.3, 0.4, 0.9))], "cube")
    camera = bpy.context.scene.camera
    keyed(camera, "location", {1: (-0.6, -6.5, 2.2), 3: (0.6, -5.5, 2.0)})
    keyed(camera, "rotation_euler", {1: (1.3, 0.0, -0.12), 3: (1.36, 0.05, 0.12)})
    keyed(camera.data, "lens", {1: 35.0, 3: 60.0})
    shutter()


@scene(1, deep=True)
def turning_object():
    """A propeller of a quarter turn with nine steps beside one with three, and one whose blur is off."""
    bench()
    for x, steps, blurred in ((-1.6, 3, True), (0.0, 1, True), (1.6, 3, False)):
        blade = kit.put("cube", kit.diffuse((0.7, 0.5, 0.2)), (x, 0, 1.0), (0.7, 0.1, 0.15))
        spinning(blade, 180.0)
        blade.cycles.motion_steps, blade.cycles.use_motion_blur = steps, blurred
    shutter()


@scene(1, deep=True)
def stretched_in_motion():
    """Objects that slide, grow and turn at once, one of them mirrored, with smooth normals and object coordinates."""
    bench()
    pattern = kit.material(
        lambda node: node(
            "BsdfDiffuse",
            Color=node("TexChecker", Vector=node("TexCoord").outputs["Object"], Scale=3.0).outputs["Color"],
        )
    )
    for x, sign in ((-1.2, 1.0), (1.2, -1.0)):
        ball = kit.put("ball", pattern, (x, 0, 0.8), 0.5)
        sliding(ball, (0.3, 0.0, 0.4))
        keyed(ball, "scale", {1: (0.4 * sign, 0.6, 0.3), 3: (0.8 * sign, 0.4, 0.7)})
        spinning(ball, 120.0, 2)
    shutter(0.8)


@scene(1)
def deforming_mesh():
    """A shape key and a wave, beside a shape key whose deformation is not blurred."""
    bench()
    clay = kit.diffuse((0.6, 0.45, 0.35))
    for x, blurred in ((-2.0, True), (2.0, False)):
        ball = kit.put("ball", clay, (x, 0, 0.8), 0.6)
        ball.shape_key_add(name="Basis")
        key = ball.shape_key_add(name="Wide")
        points = np.empty(3 * len(key.data), np.float32)
        key.data.foreach_get("co", points)
        key.data.foreach_set("co", (points.reshape(-1, 3) * (1.6, 1.0, 0.4)).astype(np.float32).ravel())
        keyed(key, "value", {1: 0.0, 3: 1.0})
        ball.cycles.use_deform_motion = blurred
    sheet = kit.put("plane", kit.diffuse((0.3, 0.5, 0.7)), (0, 0.5, 0.9), 0.8, smooth=True)
    cut = sheet.modifiers.new("Grid", "SUBSURF")
    cut.subdivision_type, cut.render_levels = "SIMPLE", 4
    wave = sheet.modifiers.new("Wave", "WAVE")
    wave.height, wave.width, wave.speed, wave.time_offset = 0.5, 0.8, 0.3, -20
    sheet.rotation_euler = (0.6, 0, 0)
    shutter()


@scene(1, deep=True)
def hair_of_a_bending_emitter():
    """Particle hair with children on a ball that grows flat while it slides and turns."""
    bench()
    data = kit.mesh("ball", [kit.diffuse((0.6, 0.5, 0.4)), kit.diffuse((0.8, 0.4, 0.2))])
    ball = kit.add(data, (0.0, 0.0, 0.9), scale=0.5)
    ball.shape_key_add(name="Basis")
    key = ball.shape_key_add(name="Wide")
    points = np.empty(3 * len(key.data), np.float32)
    key.data.foreach_get("co", points)
    key.data.foreach_set("co", (points.reshape(-1, 3) * (2.4, 1.0, 0.5)).astype(np.float32).ravel())
    keyed(key, "value", {1: 0.0, 3: 1.0})
    groom(ball, count=80, hair_length=0.8, radius_scale=0.08, child_type="INTERPOLATED", rendered_child_count=4)
    sliding(ball, (0.4, 0.0, 0.2))
    spinning(ball, 60.0, 2)
    shutter()


@scene(1, deep=True)
def moving_instances():
    """Instances of a collection whose instancers move, with an object in it that moves as well."""
    bench()
    group = bpy.data.collections.new("Group")
    for shape, x in (("cube", 0.0), ("ball", 0.5)):
        thing = kit.put(shape, kit.diffuse((0.2 + x, 0.5, 0.6)), (x, 0, 0.2), 0.2)
        sliding(thing, (0.0, 0.0, 0.3 * x))
        bpy.context.scene.collection.objects.unlink(thing)
        group.objects.link(thing)
    for i in range(6):
        empty = kit.add(None, (-2 + 1.6 * (i % 3), -1 + 1.5 * (i // 3), 0.4), rotation=(0, 0, 40 * i))
        empty.instance_type, empty.instance_collection = "COLLECTION", group
        empty.cycles.motion_steps = 1 + i % 2
        sliding(empty, (0.5 - 0.2 * i, 0.2, 0.2))
    shutter()


@scene(1, deep=True)
def shutter_that_opens_slowly():
    """A shutter whose curve is a ramp up with a gap, and which is open after the frame."""
    bench()
    sliding(kit.put("cube", kit.emission((0.9, 0.8, 0.5), 0.8), (0, 0, 0.8), 0.3), (2.0, 0.0, 0.0))
    shutter(0.9, "START", [(0.0, 0.0), (0.4, 0.6), (0.5, 0.0), (1.0, 1.0)])


@scene(1, deep=True)
def shutter_before_the_frame():
    """A shutter that closes at the frame; the camera moves along."""
    bench()
    sliding(kit.put("cube", kit.diffuse((0.8, 0.3, 0.3)), (0, 0, 0.8), 0.4), (1.5, 0.0, 0.0))
    camera = bpy.context.scene.camera
    keyed(camera, "location", {1: (-0.5, -6.0, 2.2), 3: (0.5, -6.0, 2.2)})
    shutter(0.7, "END")


@scene(1, deep=True)
def rolling_shutter():
    """A picture read line by line while the camera pans and a post passes."""
    bench()
    sliding(kit.put("cube", kit.diffuse((0.8, 0.4, 0.2)), (0, 0, 1.0), (0.15, 0.15, 1.0)), (2.0, 0.0, 0.0))
    bpy.context.scene.cycles.rolling_shutter_type = "TOP"
    bpy.context.scene.cycles.rolling_shutter_duration = 0.2
    shutter()


@scene(1, samples=768, deep=True)
def moving_emitter():
    """Emissive meshes that slide and turn over a floor, whose light is sampled."""
    kit.floor()
    bar = kit.put("cube", kit.emission((1.0, 0.7, 0.4), 12.0), (-0.8, 0.3, 0.8), (0.5, 0.05, 0.05))
    spinning(bar, 200.0, 2)
    bar.cycles.motion_steps = 3
    sheet = kit.put("plane", kit.emission((0.3, 0.5, 1.0), 6.0), (1.2, 0.5, 1.2), 0.4)
    sliding(sheet, (0.6, -0.4, 0.5))
    keyed(sheet, "rotation_euler", {1: (0.0, 0.0, 0.0), 3: (0.0, 2.5, 0.5)})
    kit.put("ball", kit.diffuse(), (0, -0.5, 0.4), 0.4)
    shutter()


def nodes_on(thing, build) -> None:
    """A geometry nodes modifier; build(node, geometry) returns the geometry that it makes."""
    group = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")

    def node(kind: str, inputs: dict | None = None, **properties):
        result = group.nodes.new(kind)
        kit.assign(result, properties)
        for name, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                group.links.new(value, kit.socket(result.inputs, name))
            else:
                kit.socket(result.inputs, name).default_value = value
        return result

    group.links.new(build(node, start.outputs[0]), end.inputs[0])
    thing.modifiers.new("Nodes", "NODES").node_group = group


@scene(1, deep=True)
def moving_along_velocities():
    """A mesh and spheres that move by an attribute `velocity` alone."""
    bench()
    ball = kit.put("ball", kit.diffuse((0.7, 0.4, 0.3)), (-1.2, 0, 0.8), 0.5)
    velocity = ball.data.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    count = len(ball.data.vertices)
    points = np.empty((count, 3), np.float32)
    ball.data.vertices.foreach_get("co", points.reshape(-1))
    velocity.data.foreach_set("vector", (24.0 * points * (0.8, 0.2, -0.4)).astype(np.float32).ravel())
    cloud = kit.put("coarse ball", kit.diffuse((0.3, 0.5, 0.8)), (1.2, 0, 0.9), 0.7)

    def flying(node, geometry):
        points = node("GeometryNodeMeshToPoints", {"Mesh": geometry, "Radius": 0.12})
        way = node("FunctionNodeInputVector", vector=(12.0, 0.0, 6.0))
        stored = node(
            "GeometryNodeStoreNamedAttribute",
            {"Geometry": points.outputs[0], "Name": "velocity", "Value": way.outputs[0]},
            data_type="FLOAT_VECTOR",
        )
        colored = node("GeometryNodeSetMaterial", {"Geometry": stored.outputs[0], "Material": cloud.data.materials[0]})
        return colored.outputs[0]

    nodes_on(cloud, flying)
    shutter()


@scene(1, deep=True)
def moving_strands_and_spheres():
    """Hair that slides and bends, and points that slide."""
    bench()
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([4] * 60)
    x, z = np.meshgrid(np.linspace(-0.6, 0.6, 60), np.linspace(0.0, 1.2, 4), indexing="ij")
    places = np.stack([x, 0.2 * np.sin(9.0 * x), z], axis=2).astype(np.float32)
    curves.position_data.foreach_set("vector", places.ravel())
    radius = curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(240, 0.02, np.float32))
    curves.materials.append(kit.diffuse((0.6, 0.4, 0.2)))
    hair = kit.add(curves, (-1.0, 0, 0))
    sliding(hair, (0.2, 0.0, 0.0))

    def bending(node, geometry):
        time = node("GeometryNodeInputSceneTime").outputs["Frame"]
        place = node("ShaderNodeSeparateXYZ", {"Vector": node("GeometryNodeInputPosition").outputs[0]})
        side = node("ShaderNodeMath", {0: time, 1: place.outputs["Z"]}, operation="MULTIPLY")
        way = node("ShaderNodeMath", {0: side.outputs[0], 1: 0.3}, operation="MULTIPLY")
        offset = node("ShaderNodeCombineXYZ", {"X": way.outputs[0]})
        return node("GeometryNodeSetPosition", {"Geometry": geometry, "Offset": offset.outputs[0]}).outputs[0]

    nodes_on(hair, bending)
    cloud = kit.put("coarse ball", kit.diffuse((0.3, 0.6, 0.4)), (1.3, 0, 0.8), 0.6)

    def pointed(node, geometry):
        points = node("GeometryNodeMeshToPoints", {"Mesh": geometry, "Radius": 0.1})
        return node(
            "GeometryNodeSetMaterial", {"Geometry": points.outputs[0], "Material": cloud.data.materials[0]}
        ).outputs[0]

    nodes_on(cloud, pointed)
    sliding(cloud, (0.3, 0.0, 0.2))
    shutter()
