"""Geometry: modifiers, normals, instances, curves, attributes, visibility."""

import math

import bpy
import numpy as np

from .. import kit
from ..registry import scene


@scene(1)
def modifiers():
    """Subdivision, an array, a shape key, and a mesh with several materials."""
    kit.floor()
    smooth = kit.put("monkey", kit.diffuse((0.8, 0.4, 0.3)), (-1.4, 0, 0.8), 0.8)
    smooth.modifiers.new("Subdivision", "SUBSURF").render_levels = 1
    boxes = kit.put("cube", kit.diffuse((0.3, 0.6, 0.4)), (0.2, -0.5, 0.25), 0.25)
    array = boxes.modifiers.new("Array", "ARRAY")
    array.count, array.relative_offset_displace = 4, (1.3, 0.4, 0.2)
    bulb = kit.put("ball", [kit.diffuse(), kit.diffuse((0.1, 0.2, 0.7)), None], (1.5, 0.8, 0.8), 0.7)
    bulb.data.polygons.foreach_set("material_index", np.arange(len(bulb.data.polygons)) // 7 % 2)
    bulb.shape_key_add(name="Basis")
    key = bulb.shape_key_add(name="Wide")
    points = np.empty(3 * len(key.data), np.float32)
    key.data.foreach_get("co", points)
    key.data.foreach_set("co", (points.reshape(-1, 3) * (1.5, 1.0, 0.6)).astype(np.float32).ravel())
    key.value = 0.7
    kit.lamp()


@scene(1)
def normals():
    """Smooth, flat, sharp edges, custom normals, and an object turned inside out by a negative scale."""
    kit.floor()
    clay = kit.diffuse((0.6, 0.5, 0.4))
    kit.put("ball", clay, (-2.1, 0, 0.5), 0.5, smooth=False)
    kit.put("cylinder", clay, (-0.7, 0, 0.5), 0.5, smooth=True)
    sharp = kit.put("cylinder", clay, (0.7, 0, 0.5), 0.5, smooth=True)
    sharp.data.set_sharp_from_angle(angle=math.radians(30))
    custom = kit.put("cube", clay, (2.1, 0, 0.5), 0.45)
    corners = np.empty(3 * len(custom.data.vertices), np.float32)
    custom.data.vertices.foreach_get("co", corners)
    custom.data.normals_split_custom_set_from_vertices(corners.reshape(-1, 3).tolist())
    kit.put("monkey", clay, (0, 1.6, 0.9), (-0.7, 0.5, 0.9))
    kit.light("POINT", 200, (-2.5, -3, 3), shadow_soft_size=0.1)
    kit.world(lambda node: node("Background", Strength=0.2))


@scene(1)
def collection_instances():
    """Instances of a collection in many places, coloured by object colour, index and random number."""
    kit.floor()

    def build(node):
        info = node("ObjectInfo")
        color = node(
            "CombineColor", Red=info.outputs["Random"], Green=0.4, Blue=node("Math", {0: 0.2}, operation="SINE")
        )
        mix = node("Mix", {"Factor_Float": 0.5, "A_Color": info.outputs["Color"], "B_Color": color}, data_type="RGBA")
        return node("BsdfDiffuse", Color=mix)

    group = bpy.data.collections.new("Group")
    for shape, x in (("cube", 0.0), ("ball", 0.5)):
        thing = kit.put(shape, kit.material(build), (x, 0, 0.2), 0.2)
        thing.color = (x * 2, 0.8, 1 - x, 1)
        bpy.context.scene.collection.objects.unlink(thing)
        group.objects.link(thing)
    for i in range(12):
        empty = kit.add(
            None, (-2 + 1.3 * (i % 4), -1.5 + 1.3 * (i // 4), 0), rotation=(0, 0, 40 * i), scale=0.6 + 0.05 * i
        )
        empty.instance_type, empty.instance_collection = "COLLECTION", group
    kit.lamp()


@scene(1)
def geometry_nodes():
    """Instances on points made by geometry nodes, with an attribute on each."""
    kit.floor()
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")

    def node(kind, **inputs):
        result = group.nodes.new(kind)
        for name, value in inputs.items():
            target = kit.socket(result.inputs, name.replace("_", " "))
            if isinstance(value, bpy.types.NodeSocket):
                group.links.new(value, target)
            else:
                target.default_value = value
        return result

    grid = node("GeometryNodeMeshGrid", Size_X=4.0, Size_Y=3.0, Vertices_X=6, Vertices_Y=5)
    ball = node("GeometryNodeMeshIcoSphere", Radius=0.25, Subdivisions=2)
    turn = node("FunctionNodeRandomValue", Max=0.9, Min=0.2)
    spread = node("GeometryNodeInstanceOnPoints", Points=grid.outputs[0], Instance=ball.outputs[0])
    spread.inputs["Scale"].default_value = (1.0, 0.7, 1.6)
    store = group.nodes.new("GeometryNodeStoreNamedAttribute")
    store.data_type, store.domain = "FLOAT", "INSTANCE"
    store.inputs["Name"].default_value = "shade"
    group.links.new(spread.outputs[0], store.inputs["Geometry"])
    group.links.new(
        next(o for o in turn.outputs if o.enabled), next(s for s in store.inputs if s.name == "Value" and s.enabled)
    )
    output = group.nodes.new("NodeGroupOutput")
    group.links.new(store.outputs[0], output.inputs[0])

    def shaded(node):
        shade = node("Attribute", attribute_name="shade", attribute_type="INSTANCER")
        value = kit.socket(shade.outputs, "Fac")
        return node("BsdfDiffuse", Color=kit.ramp(node, value, [(0.2, (0.8, 0.2, 0.1)), (0.9, (0.1, 0.3, 0.8))]))

    holder = kit.put("plane", kit.diffuse((0.6, 0.5, 0.3)), (0, 0, 0.4))
    item = kit.material(shaded)
    holder.data.materials[0] = item
    set_material = group.nodes.new("GeometryNodeSetMaterial")
    set_material.inputs["Material"].default_value = item
    group.links.new(ball.outputs[0], set_material.inputs["Geometry"])
    group.links.new(set_material.outputs[0], spread.inputs["Instance"])
    holder.modifiers.new("Scatter", "NODES").node_group = group
    kit.lamp()


@scene(1)
def curves():
    """A curve with a bevel, text, a metaball and a surface."""
    kit.floor()
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.12
    spline = curve.splines.new("BEZIER")
    spline.bezier_points.add(2)
    for point, place in zip(spline.bezier_points, ((-2.4, 0, 0.2), (-1.6, 0.4, 1.4), (-0.8, -0.3, 0.3)), strict=True):
        point.co = place
        point.handle_left_type = point.handle_right_type = "AUTO"
    curve.materials.append(kit.diffuse((0.7, 0.2, 0.2)))
    kit.add(curve)
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude, text.size = "abc", 0.1, 1.2
    text.materials.append(kit.diffuse((0.2, 0.5, 0.7)))
    kit.add(text, (-0.6, 0, 0.4), rotation=(75, 0, 0))
    ball = bpy.data.metaballs.new("Metaball")
    ball.resolution = ball.render_resolution = 0.12
    for x in (0.0, 0.7):
        ball.elements.new().co = (x, 0, 0)
    ball.elements[0].radius = ball.elements[1].radius = 0.8
    ball.materials.append(kit.diffuse((0.7, 0.6, 0.2)))
    kit.add(ball, (1.7, 0.4, 0.6))
    surface = bpy.data.curves.new("Surface", "SURFACE")
    surface.dimensions = "3D"
    for row in range(4):
        spline = surface.splines.new("NURBS")
        spline.points.add(3)
        for column, point in enumerate(spline.points):
            point.co = (0.5 * column, 0.3 * row, 0.3 * math.sin(2.0 * row + column), 1.0)
            point.select = True
    kit.lamp()


@scene(1)
def attributes():
    """Colour attributes on points and corners, bytes and floats, a plain float, and a second UV map."""
    kit.floor()
    random = np.random.default_rng(2)
    kinds = (("FLOAT_COLOR", "POINT"), ("BYTE_COLOR", "CORNER"), ("FLOAT", "FACE"), ("FLOAT_VECTOR", "POINT"))
    for x, (kind, domain) in zip((-2.1, -0.7, 0.7, 2.1), kinds, strict=True):
        item = kit.material(lambda node: node("BsdfDiffuse", Color=node("Attribute", attribute_name="shade")))
        thing = kit.put("ball", item, (x, 0, 0.6), 0.6)
        data = thing.data.attributes.new("shade", kind, domain)
        field, width = {"FLOAT": ("value", 1), "FLOAT_VECTOR": ("vector", 3)}.get(kind, ("color", 4))
        data.data.foreach_set(field, random.random(len(data.data) * width).astype(np.float32))

    def second_map(node):
        color = node("VertexColor", layer_name="tint")
        checker = node("TexChecker", Vector=node("UVMap", uv_map="Second"), Scale=6.0, Color1=color.outputs["Color"])
        return node("BsdfDiffuse", Color=checker)

    thing = kit.put("cube", kit.material(second_map), (0, 1.5, 0.7), 0.7)
    layer = thing.data.uv_layers.new(name="Second")
    layer.data.foreach_set("uv", random.random(2 * len(layer.data)).astype(np.float32))
    tint = thing.data.color_attributes.new("tint", "FLOAT_COLOR", "CORNER")
    tint.data.foreach_set("color", random.random(4 * len(tint.data)).astype(np.float32))
    kit.lamp()


@scene(1)
def ray_visibility():
    kit.floor()
    kit.put("cube", kit.diffuse((0.7, 0.7, 0.2)), (0, 1.5, 0.9), 0.9)
    switches = ("visible_camera", "visible_shadow", "visible_diffuse", "hide_render")
    for x, name in zip((-2.1, -0.7, 0.7, 2.1), switches, strict=True):
        thing = kit.put("ball", kit.diffuse((0.8, 0.2, 0.3)), (x, 0, 0.6), 0.55)
        setattr(thing, name, name == "hide_render")
    lantern = kit.put("plane", kit.emission(strength=8.0), (0, -1.5, 2.5), 0.5)
    lantern.visible_camera = False
    kit.world(lambda node: node("Background", Color=(0.2, 0.3, 0.4)))


@scene(1)
def sheared():
    """Object matrices that shear, mirror, and flatten."""
    kit.floor()
    clay = kit.diffuse((0.5, 0.6, 0.5))
    shear = np.array([[0.6, 0.3, 0.2, -1.6], [0, 0.6, 0.3, 0], [0, 0, 0.7, 0.7], [0, 0, 0, 1]])
    mirror = np.array([[-0.7, 0, 0, 0.2], [0, 0.5, 0, 0], [0, 0, 0.7, 0.7], [0, 0, 0, 1]])
    flat = np.array([[0.7, 0, 0, 1.9], [0, 0.05, 0, 0.3], [0, 0, 0.7, 0.7], [0, 0, 0, 1]])
    for matrix in (shear, mirror, flat):
        kit.transform(kit.put("monkey", clay), matrix)
    kit.lamp()


@scene(1, alike=True)
def terminator_shading_offset():
    """Coarse smooth balls of several lobes, whose terminator is softened by as much as each object asks for."""
    kit.floor()
    skin = kit.principled(Subsurface_Weight=1.0, Subsurface_Scale=0.05)
    thin = kit.material(lambda node: node("BsdfTranslucent"))
    for x, surface in ((-1.8, kit.diffuse()), (-0.6, kit.principled(Metallic=1.0)), (0.6, skin), (1.8, thin)):
        ball = kit.put("coarse ball", surface, (x, 0.0, 0.6), 0.55)
        ball.shadow_terminator_shading_offset = 0.3 + 0.2 * abs(x)
    kit.light("SUN", 3.0, (2.0, 0.5, 2.0), angle=0.1)


@scene(2)
def bump_map_correction():
    """Strong bumps on diffuse and mirroring surfaces, once with the corrections of Cycles and once without."""
    kit.floor()

    def bumped(node, kind, **inputs):
        normal = node("Bump", Height=node("TexNoise", Scale=6.0), Strength=1.0, Distance=1.0)
        return node(kind, Normal=normal, **inputs)

    for x, corrected in ((-1.0, True), (1.0, False)):
        rough = kit.material(lambda node: bumped(node, "BsdfDiffuse"))
        shiny = kit.material(lambda node: bumped(node, "BsdfGlossy", Roughness=0.3))
        rough.cycles.use_bump_map_correction = shiny.cycles.use_bump_map_correction = corrected
        kit.put("ball", rough, (x - 0.5, 0.0, 0.5), 0.45)
        kit.put("ball", shiny, (x + 0.5, 0.0, 0.5), 0.45)
    kit.lamp()
    kit.world(lambda node: node("Background", Color=(0.1, 0.15, 0.2)))
