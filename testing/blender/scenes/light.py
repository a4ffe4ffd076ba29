"""Lights and worlds on diffuse surfaces."""

import math

import bpy

from .. import kit
from ..registry import scene


def subject() -> None:
    """A floor, a box and a monkey."""
    kit.floor()
    kit.put("cube", kit.diffuse((0.7, 0.3, 0.2)), (-1.3, 0.6, 0.7), 0.7, rotation=(0, 0, 30))
    kit.put("monkey", kit.diffuse((0.3, 0.5, 0.7)), (0.9, -0.2, 0.8), 0.8, smooth=False)


@scene(1)
def area_light():
    subject()
    kit.lamp()


@scene(1)
def point_lights():
    subject()
    kit.light("POINT", 60, (-0.4, -1.6, 1.9), shadow_soft_size=0.3, use_soft_falloff=False, color=(1, 0.8, 0.5))
    kit.light("POINT", 60, (2.2, -0.6, 1.2), shadow_soft_size=0.25, use_soft_falloff=True, color=(0.5, 0.7, 1))
    kit.light("POINT", 40, (-3, -1, 2.5), shadow_soft_size=0.0)


@scene(1, alike=True)
def spot_lights():
    subject()
    spot = dict(target=(0.4, 0, 0), spot_size=math.radians(50))
    kit.light("SPOT", 700, (-2.5, -2, 3.5), spot_blend=0.5, shadow_soft_size=0.3, use_soft_falloff=False, **spot)
    kit.light("SPOT", 300, (2.5, -1, 3.5), spot_blend=0.0, shadow_soft_size=0.0, color=(1, 0.4, 0.2), **spot)
    wide = kit.light("SPOT", 300, (0, 3, 3), (0, 0, 0), spot_size=math.radians(75), spot_blend=1.0)
    wide.scale = (0.6, 1.0, 1.0)
    kit.light("SPOT", 50, (1.9, 0.2, 1.4), (0, -4, 1), spot_size=math.radians(120), shadow_soft_size=0.3)


@scene(1)
def suns():
    subject()
    kit.light("SUN", 2.0, (-2, -2, 4), angle=math.radians(12))
    kit.light("SUN", 1.0, (3, -1, 2), angle=0.0, color=(1, 0.6, 0.3))
    kit.light("SUN", 1.0, (0, 6, 2.6), (0, 0, 1.6), angle=math.radians(6))


@scene(1, alike=True)
def hdri():
    subject()
    kit.hdri("courtyard", 1.0, 70.0)


@scene(1, alike=True)
def area_shapes():
    subject()
    back = dict(target=(0, 0, 0.5))
    kit.light("AREA", 60, (-2.6, 1.5, 2.0), **back, shape="DISK", size=1.0)
    kit.light("AREA", 60, (0.0, 2.2, 2.2), **back, shape="ELLIPSE", size=1.4, size_y=0.6, color=(1, 0.5, 0.3))
    kit.light("AREA", 60, (2.4, 1.2, 2.0), **back, shape="RECTANGLE", size=0.4, size_y=1.4, color=(0.4, 0.6, 1))
    kit.light("AREA", 60, (0.6, -3.0, 3.0), **back, shape="SQUARE", size=0.8)


@scene(1, alike=True)
def area_spread():
    subject()
    for x, degrees, shape in ((-2.2, 20, "SQUARE"), (0.0, 60, "DISK"), (2.2, 120, "ELLIPSE")):
        size = dict(size=0.9, size_y=0.5)
        kit.light("AREA", 6, (x, -0.8, 2.6), (x, 0, 0), spread=math.radians(degrees), shape=shape, **size)


@scene(1, 128, alike=True)
def mesh_lights():
    subject()

    def textured(node):
        color = kit.ramp(node, node("TexNoise", Scale=3.0), [(0.4, (1, 0.1, 0.02)), (0.6, (0.2, 0.5, 1))])
        return node("Emission", Color=color, Strength=node("TexChecker", {"Color1": (40, 40, 40)}, Scale=3.0))

    def one_sided(node):
        back = node("NewGeometry").outputs["Backfacing"]
        return node("MixShader", {0: back, 1: node("Emission", Strength=20.0)})

    kit.put("ball", kit.material(textured), (-0.1, -1.2, 1.9), 0.35)
    kit.put("plane", kit.material(one_sided), (2.4, -0.5, 1.6), 0.4, rotation=(0, -60, 0))
    kit.put("plane", kit.emission((0.4, 1, 0.5), 20.0), (-2.2, -0.8, 1.5), 0.3, rotation=(0, 70, 0))


@scene(1)
def sky():
    subject()
    kinds = bpy.types.ShaderNodeTexSky.bl_rna.properties["sky_type"].enum_items
    kind = "NISHITA" if "NISHITA" in kinds else "MULTIPLE_SCATTERING"
    settings = dict(sun_elevation=math.radians(25), sun_rotation=2.4, sun_size=math.radians(4), sun_intensity=0.3)
    kit.world(lambda node: node("Background", Color=node("TexSky", sky_type=kind, **settings), Strength=0.1))


@scene(1)
def sky_preetham():
    subject()
    sun = dict(sun_direction=(-0.5, -0.6, 0.5), turbidity=2.5)
    kit.world(lambda node: node("Background", Color=node("TexSky", sky_type="PREETHAM", **sun), Strength=0.5))


@scene(1)
def light_path():
    """A world that the camera sees in another colour, and a material that lets shadow rays pass."""
    subject()

    def two_worlds(node):
        seen, unseen = node("Background", Color=(0.9, 0.7, 0.5)), node("Background", Color=(0.1, 0.3, 0.6))
        return node("MixShader", {0: node("LightPath").outputs["Is Camera Ray"], 1: unseen, 2: seen})

    def unshadowed(node):
        return node(
            "MixShader",
            {
                0: node("LightPath").outputs["Is Shadow Ray"],
                1: node("BsdfDiffuse", Color=(0.9, 0.6, 0.1)),
                2: node("BsdfTransparent", Color=(1, 0.7, 0.6)),
            },
        )

    kit.world(two_worlds)
    kit.put("ball", kit.material(unshadowed), (0.0, -1.4, 0.5), 0.5)
    kit.lamp(100)


@scene(1, alike=True)
def world_gradient():
    """A world that is dark in most directions, through a procedural texture."""
    subject()

    def build(node):
        direction = node("TexCoord").outputs["Generated"]
        gradient = node("TexGradient", Vector=node("Mapping", Vector=direction, Rotation=(0.3, 1.2, 0.6)))
        color = kit.ramp(node, gradient, [(0.5, (0.02, 0.03, 0.06)), (0.8, (3, 2, 1)), (0.9, (0.1, 0.1, 0.1))])
        return node("Background", Color=color)

    kit.world(build)


@scene(1, 192, deep=True)
def portals():
    """A room whose world comes in by two windows with portals, and by a gap without one."""
    wall = kit.diffuse((0.6, 0.6, 0.55))
    kit.floor(wall, 3.0)
    kit.put("ball", kit.diffuse((0.7, 0.4, 0.3)), (0.2, 0.3, 0.6), 0.6)
    kit.put("plane", wall, (0.0, 0.0, 3.0), 3.0)
    kit.put("plane", wall, (0.0, 3.0, 1.5), (3.0, 1.5, 1.0), rotation=(90, 0, 0))
    kit.put("plane", wall, (0.0, -3.0, 1.5), (3.0, 1.5, 1.0), rotation=(90, 0, 0))
    for x in (-3.0, 3.0):
        kit.put("plane", wall, (x, 1.9, 1.5), (1.5, 1.1, 1.0), rotation=(0, 90, 0))
        kit.put("plane", wall, (x, -1.8, 1.4), (1.4, 1.2, 1.0), rotation=(0, 90, 0))
        window = kit.light("AREA", 1.0, (x, 0.1, 1.5), (0.0, 0.1, 1.5), shape="RECTANGLE", size=1.4, size_y=3.0)
        window.data.cycles.is_portal = True
    kit.camera((0.0, -2.6, 1.6), (0.0, 0.5, 0.8), lens=24.0)
    kit.hdri("courtyard", 3.0)


@scene(1, alike=True)
def light_nodes():
    subject()

    def striped(node):
        wave = node("TexWave", Vector=node("TexCoord").outputs["Normal"], Scale=2.0)
        return node("Emission", Color=kit.ramp(node, wave, [(0.3, (1, 0.2, 0.1)), (0.7, (0.1, 0.4, 1))]), Strength=1.0)

    def warm(node):
        return node("Emission", Color=node("Blackbody", Temperature=2800.0), Strength=2.0)

    def by_position(node):
        parametric = node("NewGeometry").outputs["Parametric"]
        return node("Emission", Color=node("TexChecker", Vector=parametric, Scale=4.0), Strength=2.0)

    spot = dict(spot_size=math.radians(70), shadow_soft_size=0.1)
    kit.light("SPOT", 400, (-2, -2, 3), (-0.5, 0, 0), striped, **spot)
    kit.light("POINT", 40, (2.2, -1, 1.5), (0, 0, 0), warm, shadow_soft_size=0.2)
    kit.light("AREA", 40, (0, 2, 2), (0, 0, 0.4), by_position, size=1.2)


@scene(1, alike=True)
def many_lights():
    subject()
    for i in range(24):
        angle = 2.4 * i
        place = (3 * math.cos(angle), 3 * math.sin(angle), 0.5 + 0.1 * i)
        color = [0.5 + 0.5 * math.cos(angle + shift) for shift in (0, 2, 4)]
        kit.light("POINT", 2.0 + 2.0 * (i % 5), place, shadow_soft_size=0.05, color=color)


@scene(1, alike=True)
def light_linked_settings():
    """Lights that some rays do not see, that cast no shadow, that bounce only so often."""
    subject()
    hidden = kit.light("AREA", 60, (-2.0, 1.0, 2.0), (0, 0, 0.5), size=1.2)
    hidden.visible_camera = False
    direct = kit.light("POINT", 60, (2.2, -1.5, 2.0), shadow_soft_size=0.2, use_shadow=False, color=(1, 0.5, 0.4))
    direct.data.cycles.max_bounces = 0
    unseen = kit.light("AREA", 50, (1.0, 2.0, 2.0), (0, 0, 0.5), size=0.8, color=(0.4, 0.6, 1))
    unseen.visible_diffuse = False


@scene(1, 192, alike=True)
def cornell_box():
    white = kit.diffuse((0.75, 0.75, 0.75))
    walls = (
        ((0, 0, 0), (0, 0, 0), white),
        ((0, 0, 2), (180, 0, 0), white),
        ((0, 1, 1), (90, 0, 0), white),
        ((-1, 0, 1), (0, 90, 0), kit.diffuse((0.65, 0.05, 0.05))),
        ((1, 0, 1), (0, -90, 0), kit.diffuse((0.12, 0.45, 0.12))),
    )
    for place, rotation, item in walls:
        kit.put("plane", item, place, 1.0, rotation=rotation)
    kit.put("plane", kit.emission(strength=12.0), (0, 0, 1.99), 0.25, rotation=(180, 0, 0))
    kit.put("cube", white, (-0.35, 0.3, 0.6), (0.28, 0.28, 0.6), rotation=(0, 0, 20))
    kit.put("cube", white, (0.35, -0.3, 0.3), 0.29, rotation=(0, 0, -18))
    kit.camera((0, -3.8, 1.0), (0, 0, 1.0), lens=38)


@scene(1, film_exposure=2.5)
def exposure():
    """Exposure of the film counts; that of the view transform is not in the pixels."""
    subject()
    kit.lamp(100)
    bpy.context.scene.view_settings.exposure = 1.0


@scene(1, max_bounces=2, diffuse_bounces=1, transparent_bounces=2)
def bounce_limits():
    subject()
    kit.world(lambda node: node("Background", Color=(0.2, 0.3, 0.5)))
    veil = kit.material(lambda node: node("BsdfTransparent", Color=(0.9, 0.7, 0.7)))
    for y in (-0.8, -1.2, -1.6):
        kit.put("plane", veil, (0.9, y, 0.7), 0.5, rotation=(90, 0, 0))
    kit.lamp(100)


@scene(1, min_bounces=3, clamp_direct=1.5, clamp_indirect=0.2)
def clamps():
    subject()
    kit.lamp(600)


@scene(1, pixel_filter="GAUSSIAN", filter_width=3.0)
def wide_filter():
    subject()
    kit.lamp()


def linked(name: str, *things: bpy.types.Object, excluded: bool = False) -> bpy.types.Collection:
    """A collection for light linking; excluded: all but these."""
    found = bpy.data.collections.new(name)
    for thing in things:
        found.objects.link(thing)
    for entry in found.collection_objects:
        entry.light_linking.link_state = "EXCLUDE" if excluded else "INCLUDE"
    return found


def linking_subject() -> tuple[list[bpy.types.Object], list[bpy.types.Object]]:
    """(what is lit, lights): a glossy floor, two balls and an instanced cube; a lamp, a point light, a face."""
    # With its light tree Cycles can be a quarter too bright: findings/cycles_light_linking.sh.
    bpy.context.scene.cycles.use_light_tree = False
    shiny = kit.material(lambda node: node("BsdfGlossy", Color=(0.5, 0.5, 0.5), Roughness=0.3))
    balls = [kit.put("ball", kit.diffuse((0.8, 0.5, 0.3)), (x, 0.0, 0.7), 0.7) for x in (-1.4, 1.4)]
    cube = kit.put("cube", kit.diffuse((0.3, 0.5, 0.8)), (0.0, 0.0, 0.0), 0.4)
    group = bpy.data.collections.new("instanced")
    bpy.context.scene.collection.objects.unlink(cube)
    group.objects.link(cube)
    instancer = kit.add(None, (0.0, 0.6, 0.4))
    instancer.instance_type, instancer.instance_collection = "COLLECTION", group
    veil = kit.put(
        "plane", kit.material(lambda node: node("BsdfTransparent", Color=(0.4, 0.7, 0.4))), (-1.4, -0.3, 1.8)
    )
    lit = [kit.floor(shiny), *balls, instancer, veil]
    lamp = kit.light("AREA", 120, (-2.5, -1.5, 3.2), (0, 0, 0.5), size=0.8)
    point = kit.light("POINT", 60, (2.6, -1.0, 2.2), shadow_soft_size=0.3)
    face = kit.put("plane", kit.emission((1.0, 0.8, 0.6), 6.0), (0.0, -0.8, 3.4), 0.5)
    kit.world(lambda node: node("Background", Color=(0.2, 0.3, 0.5), Strength=0.1))
    return lit, [lamp, point, face]


@scene(1, 128, alike=True)
def light_linking():
    """Lights of their own for a ball, for all but an instancer, and for all but the floor."""
    (floor, ball, _, instancer, _), lights = linking_subject()
    lights[0].light_linking.receiver_collection = linked("ball", ball)
    lights[1].light_linking.receiver_collection = linked("instancer", instancer, excluded=True)
    lights[2].light_linking.receiver_collection = linked("floor", floor, excluded=True)


@scene(1, 128, alike=True)
def shadow_linking():
    """Lamps that one ball, and one that all but the veil and an instancer block; a face that only a ball blocks."""
    (_, left, right, instancer, veil), lights = linking_subject()
    lights[0].light_linking.blocker_collection = linked("left", left)
    lights[1].light_linking.blocker_collection = linked("veil", veil, instancer, excluded=True)
    lights[2].light_linking.blocker_collection = linked("right", right)


def caught() -> None:
    """A floor that catches the shadows of a box, of a red wall that shines on it, and of a lamp of the picture's."""
    kit.floor().is_shadow_catcher = True
    kit.put("cube", kit.diffuse((0.8, 0.1, 0.1)), (-1.3, 0.6, 0.7), 0.7, rotation=(0, 0, 30))
    kit.put("ball", kit.emission((0.2, 0.5, 1.0), 3.0), (1.5, 0.5, 0.4), 0.4)
    kit.light("SUN", 3.0, (3, -2, 4), angle=math.radians(5))
    kit.world(lambda node: node("Background", Color=(0.3, 0.4, 0.6)))


@scene(1, alike=True)
def shadow_catcher():
    """A transparent film; a catcher lies under another, and one is half transparent."""
    caught()
    bpy.context.scene.render.film_transparent = True
    kit.put("plane", kit.diffuse((0.3, 0.6, 0.3)), (1.3, -1.0, 0.8), 0.6).is_shadow_catcher = True
    half = kit.material(lambda node: node("MixShader", {1: node("BsdfDiffuse"), 2: node("BsdfTransparent")}))
    kit.put("plane", half, (-1.5, -1.5, 0.6), 0.7).is_shadow_catcher = True


@scene(1, alike=True)
def shadow_catcher_before_world():
    """The world is visible, behind a veil too; a holdout stands on the floor."""
    caught()
    kit.hdri("courtyard", 0.7, 70.0)
    veil = kit.material(lambda node: node("BsdfTransparent", Color=(0.8, 0.5, 0.5)))
    kit.put("plane", veil, (-1.4, -2.0, 1.5), 0.6, rotation=(90, 0, 0))
    kit.put("ball", kit.diffuse(), (0.2, -1.5, 0.4), 0.4).is_holdout = True


@scene(1)
def shadow_catcher_by_instancer():
    """A glossy catcher that an empty makes one, under objects that cameras or shadows do not see."""
    bpy.context.scene.render.film_transparent = True
    floor = kit.floor(kit.principled(Roughness=0.4, Specular_IOR_Level=0.5))
    bpy.context.scene.collection.objects.unlink(floor)
    group = bpy.data.collections.new("Group")
    group.objects.link(floor)
    empty = kit.add(None)
    empty.instance_type, empty.instance_collection, empty.is_shadow_catcher = "COLLECTION", group, True
    kit.put("cube", kit.diffuse((0.2, 0.6, 0.2)), (-1.3, 0.6, 0.7), 0.7).visible_camera = False
    kit.put("ball", kit.diffuse((0.2, 0.2, 0.8)), (1.2, 0.0, 0.6), 0.6).visible_shadow = False
    kit.lamp()
    kit.world(lambda node: node("Background", Color=(0.2, 0.2, 0.3)))


@scene(1, 128)
def lamps_without_mis():
    """Wide lamps near what they light, whose Multiple Importance is off: light samples alone find them, no rays do."""
    kit.floor()
    kit.put("ball", kit.diffuse((0.7, 0.6, 0.5)), (-0.9, 0.0, 0.6), 0.6)
    kit.put("ball", kit.principled(Base_Color=(0.8, 0.7, 0.5, 1.0), Metallic=1.0, Roughness=0.6), (0.9, 0.0, 0.6), 0.6)
    lights = [
        kit.light("AREA", 40.0, (-1.0, 0.5, 1.6), (-0.9, 0.0, 0.6), size=1.5),
        kit.light("POINT", 40.0, (0.9, 0.4, 1.7), shadow_soft_size=0.4),
        kit.light("SPOT", 60.0, (0.0, -1.0, 2.0), (0.0, 0.0, 0.0), shadow_soft_size=0.5, spot_size=1.5),
        kit.light("SUN", 0.5, (3.0, -3.0, 4.0), angle=1.0),
    ]
    for light in lights:
        light.data.cycles.use_multiple_importance_sampling = False
    kit.world(lambda node: node("Background", Strength=0.0))


@scene(1, 128)
def limits_of_lamps():
    """A lamp that mirrors show beyond its Max Bounces; one hidden from transmission, which rough glass is lit by."""
    kit.floor()
    mirror = kit.material(lambda node: node("BsdfGlossy", Roughness=0.0))
    kit.put("cube", mirror, (-0.9, 0.2, 0.7), 0.6, rotation=(0, 0, 30))
    kit.put("ball", kit.material(lambda node: node("BsdfGlass", Roughness=0.2, IOR=1.4)), (0.9, 0.0, 0.6), 0.6)
    kit.light("AREA", 150.0, (-0.5, -2.5, 2.5), (-0.9, 0.0, 0.6), size=2.0).data.cycles.max_bounces = 0
    kit.light("POINT", 60.0, (1.2, 1.8, 1.2), shadow_soft_size=0.3).visible_transmission = False
    kit.world(lambda node: node("Background", Strength=0.0))
