"""A still life on an oak table by candlelight and the light of a window.

`build()` makes everything from the tables below through bpy: no file but one of Blender's own HDRIs. Lengths are
metres; profiles are (radius, height) in centimetres.
"""

import math
import random

import bpy
from mathutils import Vector, noise

from .modelling import box, develop, interior, look, material, mesh_object, subsurface, turned

# Materials: inputs of Principled by name, and what varies over the surface: a pattern (`modelling.PATTERNS`) with the
# colours it runs through, its scale by axis, and the strength of the bump it gives.
# fmt: off
MATERIALS = {
    "Oak": ({"Roughness": 0.42, "Coat Weight": 0.25, "Coat Roughness": 0.28},
            ("grain", ["1d0d06", "4a2511", "6e3d1c", "52290f"], (1.1, 11.0, 11.0), 0.10)),
    "Plaster": ({"Roughness": 0.95}, ("cloud", ["2a211a", "403328", "544434", "43362a"], (2.2, 2.2, 2.2), 0.25)),
    "Linen": ({"Roughness": 0.9, "Sheen Weight": 0.55, "Sheen Roughness": 0.35, "Sheen Tint": "f2e6d2"},
              ("fine", ["a89a84", "cfc3ae", "e2d8c6", "cfc3ae"], (330.0, 330.0, 330.0), 0.18)),
    "Copper": ({"Metallic": 1.0, "Roughness": 0.22, "Specular Tint": "ffd9c2"},
               ("hammer", ["c8683c", "d9814f", "c8683c", "9a4a2c"], (42.0, 42.0, 42.0), 0.35)),
    "Brass": ({"Base Color": "d9a441", "Metallic": 1.0, "Roughness": 0.16}, None),
    "Gold": ({"Base Color": "f2bf55", "Metallic": 1.0, "Roughness": 0.25}, None),
    "Glass": ({"Base Color": "ffffff", "Roughness": 0.0, "IOR": 1.5, "Transmission Weight": 1.0}, None),
    "Wine": ({"Base Color": "a01024", "Roughness": 0.0, "IOR": 1.34, "Transmission Weight": 1.0}, None),
    "Celadon": ({"Roughness": 0.35, "Coat Weight": 1.0, "Coat Roughness": 0.04, "Coat IOR": 1.55},
                ("cloud", ["3f6f68", "6b9a8c", "8db7a5", "55857a"], (9.0, 9.0, 14.0), 0.02)),
    "Lacquer": ({"Base Color": "8c0b0b", "Roughness": 0.45, "Coat Weight": 1.0, "Coat Roughness": 0.02,
                 "Coat IOR": 1.6}, None),
    "Orange": ({"Roughness": 0.38, "Specular IOR Level": 0.6, **subsurface(0.6, (1.0, 0.4, 0.08), 0.004)},
               ("peel", ["de6209", "e8740c", "ec7c12", "e46c0a"], (260.0, 260.0, 260.0), 0.22)),
    "Pear": ({"Roughness": 0.36, "Coat Weight": 0.3, "Coat Roughness": 0.2, **subsurface(0.7, (1.0, 0.8, 0.3), 0.004)},
             ("cloud", ["7c8a1e", "b3a52c", "c8a838", "a8682a"], (26.0, 26.0, 9.0), 0.05)),
    "Grape": ({"Coat Weight": 0.6, "Coat Roughness": 0.12, "Roughness": 0.5, **subsurface(0.8, (1.0, 0.3, 0.5), 0.005)},
              ("cloud", ["1a0a24", "2c1038", "4a2e62", "6a5a86"], (60.0, 60.0, 60.0), 0.0)),
    "Stem": ({"Base Color": "3a2412", "Roughness": 0.8}, None),
    "Wax": ({"Base Color": "efe3c8", "Roughness": 0.4, "Coat Weight": 0.2,
             **subsurface(1.0, (1.0, 0.6, 0.3), 0.012)}, None),
    "Leather": ({"Roughness": 0.45, "Coat Weight": 0.15, "Coat Roughness": 0.3},
                ("peel", ["0c1f22", "12302f", "183c38", "0c2625"], (190.0, 190.0, 190.0), 0.35)),
    "Paper": ({"Roughness": 0.9}, ("fine", ["b8a47c", "d8c8a2", "e6d9b8", "c8b68c"], (2.0, 2.0, 900.0), 0.3)),
    "Flame": ({"Base Color": "000000", "Emission Color": "ffb259", "Emission Strength": 180.0}, None),
    "Wick": ({"Base Color": "0a0806", "Roughness": 0.9}, None),
}

# Turned objects: profile, material, place. A point written twice makes a sharp edge.
VASE = [(0, 0), (4.6, 0), (4.6, 0), (5.2, 0.8), (8.6, 7), (9.6, 12.5), (7.6, 18.5), (3.6, 23), (2.9, 26), (4.3, 29.2),
        (4.0, 29.4), (2.5, 26), (3.0, 23), (7.0, 18.3), (9.0, 12.5), (4.5, 1.4), (0, 1.2)]
GOBLET = [(0, 0), (3.7, 0), (3.8, 0.25), (1.2, 0.75), (0.45, 1.6), (0.4, 6), (0.55, 8.4), (2.5, 9.6), (3.9, 12.4),
          (4.1, 15.5), (3.35, 19.6), (3.2, 19.7), (3.1, 19.6), (3.85, 15.5), (3.65, 12.6), (2.3, 10.2), (0, 9.4)]
WINE = [(0, 9.45), (2.28, 10.25), (3.62, 12.62), (3.8, 14.2), (3.8, 14.2), (0, 14.2)]
BOWL = [(0, 0), (4.2, 0), (4.2, 0), (4.0, 0.9), (4.0, 0.9), (9.2, 3.6), (12.4, 8.6), (12.7, 8.7), (12.5, 8.9),
        (12.1, 8.8), (8.8, 4.2), (3.5, 1.7), (0, 1.5)]
STICK = [(0, 0), (5.6, 0), (5.8, 0.5), (5.2, 1.2), (2.2, 1.8), (1.2, 3.2), (1.9, 4.4), (1.0, 5.6), (0.8, 8.8),
         (1.6, 10.2), (0.9, 11.4), (1.3, 12.8), (3.3, 13.6), (3.4, 13.9), (1.5, 13.8), (1.4, 15.6), (0, 15.5)]
CANDLE = [(0, 14.8), (1.12, 14.8), (1.12, 14.8), (1.14, 20), (1.1, 25.4), (0.95, 25.9), (0.6, 25.6), (0, 25.5)]
FLAME = [(0, 26.3), (0.28, 26.6), (0.42, 27.2), (0.36, 28.2), (0.17, 29.4), (0.03, 30.4), (0, 30.6)]
WICK = [(0, 25.3), (0.09, 25.3), (0.09, 26.9), (0, 27.0)]
JAR = [(0, 0), (3.2, 0), (3.2, 0), (4.9, 2.2), (5.2, 4.6), (4.4, 7), (4.4, 7), (4.6, 7.1), (4.6, 7.4), (3.2, 8.6),
       (0.8, 9.1), (0.6, 9.5), (1.0, 10.2), (0.6, 10.8), (0, 10.9)]
PEAR = [(0, 0.3), (1.6, 0), (3.6, 1.8), (3.9, 4), (2.9, 6.6), (1.75, 8.8), (1.3, 10), (0.6, 10.5), (0, 10.2)]
BERRY = [(0, -1), (0.72, -0.72), (1, 0), (0.72, 0.72), (0, 1)]

TURNED = [  # name, profile, material, location, rotation, scale
    ("Vase", VASE, "Celadon", (-0.135, 0.10, 0), (0, 0, 0), 1.0),
    ("Goblet", GOBLET, "Glass", (0.165, -0.045, 0), (0, 0, 0), 1.0),
    ("Wine", WINE, "Wine", (0.165, -0.045, 0), (0, 0, 0), 1.0),
    ("Bowl", BOWL, "Copper", (0.015, 0.02, 0), (0, 0, 0), 1.0),
    ("Candlestick", STICK, "Brass", (0.275, 0.12, 0), (0, 0, 0), 1.0),
    ("Candle", CANDLE, "Wax", (0.275, 0.12, 0), (0, 0, 0), 1.0),
    ("Flame", FLAME, "Flame", (0.275, 0.12, 0), (0, 0, 0), 1.0),
    ("Wick", WICK, "Wick", (0.275, 0.12, 0), (0, 0, 0), 1.0),
    ("Jar", JAR, "Lacquer", (-0.245, -0.045, 0.043), (0, 0, 0.3), 0.85),
    ("Pear", PEAR, "Pear", (-0.105, -0.135, 0.0), (0, 0, 0.4), 0.95),
    ("Lying pear", PEAR, "Pear", (-0.005, -0.150, 0.035), (math.radians(97), 0, math.radians(140)), 0.9),
    ("Orange", BERRY, "Orange", (-0.030, 0.045, 0.083), (0.3, 0.2, 0), 3.9),
    ("Orange behind", BERRY, "Orange", (0.045, 0.070, 0.085), (1.3, 0.2, 0), 3.8),
    ("Orange on top", BERRY, "Orange", (0.012, 0.052, 0.140), (0.9, 1.2, 0), 3.7),
    ("Orange on table", BERRY, "Orange", (0.105, -0.165, 0.037), (2.0, 0.4, 0), 3.7),
]
# fmt: on


def build(width: int = 960, height: int = 640) -> bpy.types.Scene:
    """Replace the open file by the still life and return its scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    materials = {name: material(name, *row) for name, row in MATERIALS.items()}
    for name, profile, kind, location, rotation, scale in TURNED:
        turned(name, profile, materials[kind], location, rotation, scale)
    table(materials)
    linen(materials["Linen"])
    book(materials)
    grapes(materials)
    stems(materials["Stem"])
    interior(scene, turn=250.0, strength=1.3)
    look(scene, (0.05, -1.42, 0.42), (0.015, 0.0, 0.098), focus=(0.03, -0.10, 0.06), lens=70.0, fstop=4.0)
    develop(scene, width, height)
    return scene


def table(materials: dict) -> None:
    """Five oak boards and the wall behind them."""
    for i in range(5):
        y = -0.17 + 0.142 * i
        board = box(f"Board {i}", (2.4, 0.14, 0.035), materials["Oak"], (0.13 * (i % 3) - 0.1, y, -0.0175), bevel=0.003)
        board.rotation_euler.x = math.pi * (i % 2)
    wall = [(-2.5, 0.0, -1.0), (2.5, 0.0, -1.0), (2.5, 0.0, 2.0), (-2.5, 0.0, 2.0)]
    mesh_object("Wall", wall, [], [(0, 1, 2, 3)], materials["Plaster"], (0, 0.75, 0))


def linen(surface) -> None:
    """A cloth that lies in folds on the table and hangs over its front edge."""
    columns, rows, edge, radius = 150, 220, -0.252, 0.012
    vertices = []
    for j in range(rows + 1):
        for i in range(columns + 1):
            x, along = -0.36 + 0.33 * i / columns, 0.20 - 0.46 * j / rows
            fall = max(0.0, edge + 0.01 - along)
            turn = min(fall / radius, 0.5 * math.pi)
            drop = max(0.0, fall - 0.5 * math.pi * radius)
            ripple = noise.noise(Vector((9.0 * x, 7.0 * along, 1.0))) + 0.5 * noise.noise(
                Vector((22.0 * x, 16.0 * along, 5.0))
            )
            fold = (0.35 + 7.0 * drop) * (1.0 + math.sin(46.0 * x + 2.2 * ripple + 5.0 * along))
            lift = 0.0035 * max(0.0, 1.0 + ripple) + 0.0018
            y = (
                max(along, edge + 0.01)
                - radius * math.sin(turn)
                - 0.012 * fold * math.sin(turn)
                - 0.004 * math.sin(turn)
            )
            z = lift * math.cos(turn) - radius * (1.0 - math.cos(turn)) - drop + 0.002
            vertices.append((x + 0.02 * noise.noise(Vector((3.0 * x, 5.0 * along, 9.0))), y, z))
    step = columns + 1
    faces = [
        (j * step + i, j * step + i + 1, (j + 1) * step + i + 1, (j + 1) * step + i)
        for j in range(rows)
        for i in range(columns)
    ]
    cloth = mesh_object("Linen", vertices, [], faces, surface)
    thickness = cloth.modifiers.new("Thickness", "SOLIDIFY")
    thickness.thickness, thickness.offset = 0.0012, 1.0


def book(materials: dict) -> None:
    """A book bound in leather, its title in gold."""
    frame = bpy.data.objects.new("Book", None)
    frame.location, frame.rotation_euler = (-0.245, -0.045, 0.003), (0, 0, math.radians(-14))
    bpy.context.scene.collection.objects.link(frame)
    parts = [
        box("Lower cover", (0.20, 0.15, 0.003), materials["Leather"], (0, 0, 0.0035), bevel=0.001),
        box("Upper cover", (0.20, 0.15, 0.003), materials["Leather"], (0, 0, 0.0385), bevel=0.001),
        box("Spine", (0.20, 0.004, 0.038), materials["Leather"], (0, -0.074, 0.021), bevel=0.0018),
        box("Pages", (0.193, 0.142, 0.0325), materials["Paper"], (0, 0.0, 0.021), bevel=0.0006),
    ]
    text = bpy.data.curves.new("Title", "FONT")
    text.body, text.size, text.extrude, text.align_x, text.align_y = "ReSTIR", 0.026, 0.0003, "CENTER", "CENTER"
    text.space_character = 1.15
    text.materials.append(materials["Gold"])
    title = bpy.data.objects.new("Title", text)
    title.location, title.rotation_euler = (0, -0.0763, 0.0205), (math.radians(90), 0, 0)
    bpy.context.scene.collection.objects.link(title)
    for x in (-0.085, -0.078, 0.078, 0.085):
        parts.append(box("Band", (0.0016, 0.0012, 0.0385), materials["Gold"], (x, -0.0757, 0.021), bevel=0.0003))
    for part in (*parts, title):
        part.parent = frame


def grapes(materials: dict) -> None:
    """A bunch that hangs over the rim of the bowl: every grape shares one mesh."""
    dice = random.Random(5)
    first = turned("Grape", BERRY, materials["Grape"], (0, 0, 0), scale=1.0)
    places: list[Vector] = []
    while len(places) < 44:
        along = dice.random()
        centre = Vector((0.070, -0.010, 0.108)).lerp(Vector((0.150, -0.085, 0.012)), along)
        centre.z += 0.035 * math.sin(math.pi * along)
        spread = 0.036 * (1.0 - 0.6 * along)
        place = centre + Vector(dice.gauss(0.0, 0.5) * spread for _ in range(3))
        clear_of_bowl = math.hypot(place.x - 0.015, place.y - 0.02) > 0.137 or place.z > 0.098
        if place.z > 0.0095 and clear_of_bowl and all((place - other).length > 0.0165 for other in places):
            places.append(place)
    shared = bpy.data.meshes.new_from_object(first.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    bpy.data.objects.remove(first)
    for place in places:
        grape = bpy.data.objects.new("Grape", shared)
        grape.location, grape.rotation_euler = place, [dice.uniform(0, 6) for _ in range(3)]
        grape.scale = (dice.uniform(0.86, 1.0),) * 3
        bpy.context.scene.collection.objects.link(grape)


def stems(surface) -> None:
    """The stems of the pears, as curves."""
    for name, points in {
        "Stem": [(-0.105, -0.135, 0.096), (-0.103, -0.136, 0.106), (-0.097, -0.139, 0.116)],
        "Lying stem": [(0.056, -0.088, 0.024), (0.066, -0.080, 0.026), (0.072, -0.070, 0.031)],
    }.items():
        curve = bpy.data.curves.new(name, "CURVE")
        curve.dimensions, curve.bevel_depth, curve.bevel_resolution = "3D", 0.0013, 3
        spline = curve.splines.new("NURBS")
        spline.points.add(len(points) - 1)
        for point, place in zip(spline.points, points, strict=True):
            point.co = (*place, 1.0)
        spline.use_endpoint_u = True
        curve.materials.append(surface)
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, curve))
