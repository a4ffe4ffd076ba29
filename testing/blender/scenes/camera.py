"""Cameras, the film, and what lies behind it."""

import math

import bpy

from .. import kit
from ..registry import scene


def subject() -> None:
    """Coloured balls at several depths."""
    kit.floor()
    colors = ((0.8, 0.2, 0.2), (0.2, 0.7, 0.3), (0.2, 0.3, 0.8), (0.7, 0.6, 0.2))
    for i, color in enumerate(colors):
        kit.put("ball", kit.diffuse(color), (-1.5 + i, -2.0 + 1.4 * i, 0.5), 0.5)
    kit.lamp()
    kit.world(lambda node: node("Background", Color=(0.1, 0.15, 0.2)))


@scene(1)
def orthographic():
    subject()
    kit.camera((3, -6, 4), type="ORTHO", ortho_scale=6.5, shift_x=0.1)


@scene(1)
def panorama():
    subject()
    part = dict(latitude_min=-1.2, longitude_max=2.0)
    kit.camera((0.2, -0.6, 1.0), (0, 3, 1.0), type="PANO", panorama_type="EQUIRECTANGULAR", **part)


def look_around(kind: str, dof=None, **properties) -> None:
    """A panorama; its properties are the camera's or, before Blender 5, Cycles' own."""
    subject()
    data = kit.camera((0.2, -0.6, 1.0), (0, 3, 1.0), type="PANO").data
    kit.assign(data, {"dof": dof or {}})
    kit.assign(data if hasattr(data, "panorama_type") else data.cycles, {"panorama_type": kind} | properties)


@scene(1)
def fisheye_equidistant():
    """Nothing is seen outside of the circle, also where the film is transparent."""
    look_around("FISHEYE_EQUIDISTANT", fisheye_fov=4.5)
    bpy.context.scene.render.film_transparent = True


@scene(1)
def fisheye_equisolid():
    look_around("FISHEYE_EQUISOLID", dof=dict(use_dof=True, focus_distance=2.0, aperture_fstop=0.1), fisheye_lens=8.0)


@scene(1)
def fisheye_polynomial():
    look_around("FISHEYE_LENS_POLYNOMIAL", fisheye_fov=2.8, fisheye_polynomial_k2=-0.0008)


@scene(1)
def mirror_ball():
    look_around("MIRRORBALL", dof=dict(use_dof=True, focus_distance=2.0, aperture_fstop=0.1))


@scene(1)
def cube_face():
    """Colours by Window coordinates, which go by the projection."""
    look_around("EQUIANGULAR_CUBEMAP_FACE")
    window = kit.material(lambda node: node("Emission", Color=node("TexCoord").outputs["Window"]))
    kit.put("plane", window, (0.0, 3.0, 1.5), 1.5, rotation=(70, 0, 20))


@scene(1)
def cylindrical():
    v = dict(central_cylindrical_range_v_min=-0.6, central_cylindrical_range_v_max=0.9)
    u = dict(central_cylindrical_range_u_min=-2.0, central_cylindrical_range_u_max=1.5)
    look_around("CENTRAL_CYLINDRICAL", central_cylindrical_radius=1.2, **u, **v)


@scene(1)
def layer_without_sky():
    """A view layer that shows no world is not lit by it."""
    subject()
    bpy.context.view_layer.use_sky = False


@scene(1)
def layer_without_surfaces():
    """A view layer without surfaces shows the world alone."""
    subject()
    bpy.context.view_layer.use_solid = False


@scene(1)
def flattened():
    """Planes without thickness whose objects are scaled by 0; what has two users is not there."""
    subject()
    kit.put("plane", kit.diffuse((0.8, 0.1, 0.1)), (-1.0, -2.5, 1.0), (0.8, 0.8, 0.0), rotation=(60, 0, 20))
    shared = kit.put("plane", kit.diffuse((0.1, 0.1, 0.8)), (1.0, -2.5, 1.0), (0.8, 0.8, 0.0), rotation=(60, 0, 0))
    kit.add(shared.data, (0.0, -2.0, 2.0), scale=(0.8, 0.8, 0.0))


@scene(1, 256, alike=True)
def instancers_in_layers():
    """Holdout and Indirect Only of instancers' collections, around a mirror that sees all of it."""
    kit.floor()
    kit.lamp()
    kit.world(lambda node: node("Background", Color=(0.1, 0.15, 0.2)))
    kit.put("plane", kit.principled(Metallic=1.0, Roughness=0.1), (0, 2.5, 2), 2.5, rotation=(90, 0, 0))
    ball = kit.put("ball", kit.diffuse((0.8, 0.2, 0.2)), scale=0.5)
    bpy.context.scene.collection.objects.unlink(ball)
    group = bpy.data.collections.new("Group")
    group.objects.link(ball)
    for x, name in ((-1.2, "holdout"), (0.0, "indirect_only"), (1.2, "name")):
        shown = bpy.data.collections.new(name)
        bpy.context.scene.collection.children.link(shown)
        empty = bpy.data.objects.new(name, None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", group, (x, -1.0, 0.5)
        shown.objects.link(empty)
        if name != "name":
            setattr(bpy.context.view_layer.layer_collection.children[name], name, True)
    bpy.context.scene.render.film_transparent = True


@scene(1)
def shift_and_fit():
    subject()
    kit.camera(shift_x=0.2, shift_y=-0.15, sensor_fit="VERTICAL", sensor_height=20, lens=30)
    bpy.context.scene.render.pixel_aspect_x = 1.4


@scene(1, 256, alike=True)
def depth_of_field():
    """A bokeh of five blades, turned and squeezed, on small lights."""
    subject()
    for i in range(5):
        kit.put("ball", kit.emission((1, 0.8, 0.6), 10.0), (-2 + i, 4.0, 1.2 + 0.4 * (i % 2)), 0.08)
    dof = dict(use_dof=True, focus_distance=5.0, aperture_fstop=0.12, aperture_blades=5, aperture_rotation=0.4)
    kit.camera(dof=dof | {"aperture_ratio": 1.5})


@scene(1)
def focus_object():
    """A round aperture, focused on an object that is not in the middle; panoramas and parallel views blur as well."""
    subject()
    focus = bpy.data.objects["ball.001"]
    kit.camera(type="ORTHO", ortho_scale=6.0, dof=dict(use_dof=True, focus_object=focus, aperture_fstop=0.02))


@scene(1)
def film_transparent():
    """Alpha where the world shows, behind a veil, and a holdout material and object."""
    subject()
    bpy.context.scene.render.film_transparent = True
    veil = kit.material(lambda node: node("BsdfTransparent", Color=(0.8, 0.5, 0.5)))
    kit.put("plane", veil, (-1.4, -1.0, 1.9), 0.8, rotation=(90, 0, 0))

    def half(node):
        return node("MixShader", {0: 0.6, 1: node("BsdfDiffuse"), 2: node("Holdout")})

    kit.put("ball", kit.material(half), (0.4, -2.2, 1.2), 0.4)
    kit.put("cube", kit.diffuse(), (1.6, -1.5, 0.8), 0.4).is_holdout = True


@scene(1, 128)
def transparent_glass():
    """Glass that is smooth enough shows that there is nothing behind it; rougher glass does not."""
    kit.floor()
    kit.put("ball", kit.diffuse((0.8, 0.2, 0.2)), (0.0, 1.0, 0.5), 0.5)
    kit.world(lambda node: node("Background", Color=(0.6, 0.7, 0.8)))
    render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    render.film_transparent = cycles.film_transparent_glass = True
    cycles.film_transparent_roughness = 0.2
    for x, roughness in ((-1.0, 0.0), (0.2, 0.15), (1.4, 0.3)):
        glass = kit.material(lambda node, roughness=roughness: node("BsdfGlass", Roughness=roughness, IOR=1.2))
        kit.put("ball", glass, (x, -2.0, 2.0), 0.5)


@scene(1)
def border():
    """A render border with crop, at half the resolution."""
    subject()
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 192, 108, 50
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.2, 0.9, 0.1, 0.75


@scene(1)
def clipping():
    """Clip distances cut what the camera sees, not what lights and shadows."""
    subject()
    kit.camera(clip_start=4.6, clip_end=7.4)


@scene(1)
def camera_data():
    """Colours by distance and view vector."""
    kit.floor(kit.material(lambda node: node("BsdfDiffuse", Color=by_depth(node))))
    kit.put("monkey", kit.material(lambda node: node("Emission", Color=by_view(node), Strength=0.5)), (0, 0, 1))
    kit.lamp()
    kit.camera(angle=math.radians(50))


def by_depth(node):
    """Stripes of the distance along the view axis."""
    data = node("CameraData")
    mapped = node("MapRange", {"Value": data.outputs["View Z Depth"], "From Min": 4.0, "From Max": 10.0})
    return kit.ramp(node, mapped, [(0.1, (0.8, 0.3, 0.1)), (0.5, (0.2, 0.7, 0.3)), (0.9, (0.2, 0.2, 0.8))])


def by_view(node):
    """The direction of view as a colour."""
    return node("VectorMath", {0: node("CameraData").outputs["View Vector"]}, operation="ABSOLUTE")
