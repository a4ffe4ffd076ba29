"""A hand shields a candle's flame; a jade disc, a bowl of milk and a bar of soap stand by: light below surfaces.

`build()` makes everything from the tables below through bpy: no file but one of Blender's own HDRIs. Lengths are
metres; profiles are (radius, height) in centimetres, and so is the hand.
"""

import itertools
import math

import bmesh
import bpy
from mathutils import Matrix, Quaternion, Vector

from .modelling import box, develop, interior, look, material, mesh_object, subsurface, turned

# Materials: inputs of Principled by name, and what varies over the surface: a pattern (`modelling.PATTERNS`) with the
# colours it runs through, its scale by axis, and the strength of the bump it gives.
# fmt: off
MATERIALS = {
    "Skin": ({"Roughness": 0.42, "Specular IOR Level": 0.4, **subsurface(1.0, (1.0, 0.32, 0.16), 0.0055)},
             ("cloud", ["b8705a", "cf9077", "d9a087", "c98068"], (0.8, 0.8, 0.8), 0.0)),
    "Nail": ({"Base Color": "dba596", "Roughness": 0.22, **subsurface(1.0, (1.0, 0.4, 0.25), 0.003)}, None),
    "Wax": ({"Base Color": "f2e2c0", "Roughness": 0.4, "Coat Weight": 0.15,
             **subsurface(1.0, (1.0, 0.62, 0.3), 0.011)}, None),
    "Jade": ({"Roughness": 0.18, "Coat Weight": 0.6, "Coat Roughness": 0.05,
              **subsurface(1.0, (0.45, 1.0, 0.6), 0.008)},
             ("cloud", ["1d5c38", "3f8a5c", "86bf96", "2f7a4c"], (0.35, 0.35, 0.35), 0.0)),
    "Milk": ({"Base Color": "fdf8ec", "Roughness": 0.12, "IOR": 1.35, **subsurface(1.0, (1.0, 0.9, 0.65), 0.004)},
             None),
    "Soap": ({"Base Color": "d79a5b", "Roughness": 0.32, **subsurface(1.0, (1.0, 0.5, 0.18), 0.012)}, None),
    "Walnut": ({"Roughness": 0.38, "Coat Weight": 0.3, "Coat Roughness": 0.25},
               ("grain", ["120a06", "2c170c", "43240f", "321a0c"], (1.1, 11.0, 11.0), 0.10)),
    "Plaster": ({"Roughness": 0.95}, ("cloud", ["1b1c20", "2a2b30", "383a40", "2d2e33"], (2.2, 2.2, 2.2), 0.25)),
    "Stoneware": ({"Base Color": "2b3440", "Roughness": 0.35, "Coat Weight": 0.7, "Coat Roughness": 0.12}, None),
    "Ebony": ({"Base Color": "0d0908", "Roughness": 0.3, "Coat Weight": 0.4, "Coat Roughness": 0.1}, None),
    "Sleeve": ({"Base Color": "20303f", "Roughness": 0.9, "Sheen Weight": 0.4}, None),
    "Flame": ({"Base Color": "000000", "Emission Color": "ffb259", "Emission Strength": 260.0}, None),
    "Wick": ({"Base Color": "0a0806", "Roughness": 0.9}, None),
}

CANDLE = [(0, 0), (3.3, 0), (3.4, 0.3), (3.4, 6), (3.38, 12.2), (3.2, 12.9), (2.7, 12.8), (1.6, 11.9), (0, 11.6)]
FLAME = [(0, 12.7), (0.33, 13.1), (0.5, 13.8), (0.42, 14.9), (0.2, 16.2), (0.03, 17.3), (0, 17.5)]
WICK = [(0, 11.4), (0.1, 11.4), (0.1, 13.1), (0, 13.2)]
BOWL = [(0, 0), (3.4, 0), (3.5, 0.5), (6.6, 2.6), (7.9, 5.2), (8.05, 5.35), (7.8, 5.4), (6.4, 2.9), (3, 0.9), (0, 0.8)]
MILK = [(0, 1.0), (3.2, 1.1), (6.3, 2.95), (7.35, 4.5), (7.28, 4.62), (7.0, 4.58), (0, 4.56)]
STAND = [(0, 0), (4.6, 0), (4.7, 0.4), (3.9, 0.9), (1.5, 1.3), (1.3, 1.7), (0, 1.7)]

TURNED = [  # name, profile, material, location
    ("Candle", CANDLE, "Wax", (0.02, 0.06, 0.0)),
    ("Flame", FLAME, "Flame", (0.02, 0.06, 0.0)),
    ("Wick", WICK, "Wick", (0.02, 0.06, 0.0)),
    ("Bowl", BOWL, "Stoneware", (-0.06, -0.16, 0.0)),
    ("Milk", MILK, "Milk", (-0.06, -0.16, 0.0)),
    ("Stand", STAND, "Ebony", (-0.20, 0.02, 0.0)),
]
# fmt: on

DISC_RADIUS, DISC_HOLE, DISC_THICKNESS = 8.2, 2.1, 1.1  # the jade disc, cm
DISC_ROWS = (3.0, 4.3, 5.6, 6.9)  # radii of its rows of grains

# The hand lies along x from the wrist, thumb on the side of +y, palm towards +z. A bone is a capsule from one joint
# to the next, each joint (x, y, z, radius).
FOREARM = [(-30.0, -4.0, 0.5, 4.2), (-12.0, -1.0, 0.2, 3.3), (-1.5, 0.0, 0.0, 2.5), (1.0, 0.2, 0.0, 2.2)]
THUMB = [(1.6, 1.4, 0.8, 1.6), (5.0, 4.1, 1.9, 1.3), (8.3, 5.6, 2.1, 1.05), (10.9, 6.6, 1.9, 0.82)]
KNUCKLES = {  # where a finger begins, its radius there, lengths of its bones, spread and bend of its joints in degrees
    "Index": ((9.0, 2.9, 0.0), 1.14, (3.9, 2.4, 1.8), 5.0, (14.0, 20.0, 12.0)),
    "Middle": ((9.4, 0.8, -0.2), 1.18, (4.3, 2.7, 1.9), 1.0, (18.0, 24.0, 14.0)),
    "Ring": ((8.9, -1.3, -0.1), 1.1, (3.9, 2.5, 1.9), -3.0, (22.0, 28.0, 16.0)),
    "Little": ((7.9, -3.2, 0.2), 0.98, (3.1, 1.9, 1.6), -8.0, (26.0, 30.0, 18.0)),
}
TAPER = 0.86  # radius of a joint by that of the one before


def build(width: int = 960, height: int = 640) -> bpy.types.Scene:
    """Replace the open file by the scene and return it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    materials = {name: material(name, *row) for name, row in MATERIALS.items()}
    for name, profile, kind, location in TURNED:
        turned(name, profile, materials[kind], location)
    table(materials)
    jade_disc(materials["Jade"])
    hand(materials)
    soap(materials["Soap"])
    interior(scene, turn=205.0, strength=0.4)
    window(scene)
    lamp(scene)
    look(scene, (0.03, -1.05, 0.40), (-0.005, 0.0, 0.088), focus=(0.06, -0.05, 0.13), lens=70.0, fstop=5.6)
    develop(scene, width, height)
    return scene


def table(materials: dict) -> None:
    """Five boards and the wall behind them."""
    for i in range(5):
        size, place = (2.4, 0.16, 0.035), (0.13 * (i % 3) - 0.1, -0.26 + 0.162 * i, -0.0175)
        board = box(f"Board {i}", size, materials["Walnut"], place, bevel=0.003)
        board.rotation_euler.x = math.pi * (i % 2)
    wall = [(-2.5, 0.0, -1.0), (2.5, 0.0, -1.0), (2.5, 0.0, 2.0), (-2.5, 0.0, 2.0)]
    mesh_object("Wall", wall, [], [(0, 1, 2, 3)], materials["Plaster"], (0, 0.75, 0))


def jade_disc(surface) -> None:
    """A ring-shaped disc with rows of grains on both faces, upright on its stand."""
    inner, outer, half = DISC_HOLE, DISC_RADIUS, 0.5 * DISC_THICKNESS
    middle, width = 0.5 * (inner + outer), 0.5 * (outer - inner)
    disc = bmesh.new()
    steps = 180
    for i in range(steps):  # overlapping boxes around the hole; the remesher makes one skin of them and the grains
        turn = Matrix.Rotation(2.0 * math.pi * i / steps, 4, "Z") @ Matrix.Translation((middle, 0.0, 0.0))
        size = Matrix.Diagonal((2.0 * width, 2.2 * math.pi * outer / steps, 2.0 * half, 1.0))
        bmesh.ops.create_cube(disc, size=1.0, matrix=turn @ size)
    for ring, radius in enumerate(DISC_ROWS):
        count = round(2.0 * math.pi * radius / 1.5)
        for i in range(count):
            angle = 2.0 * math.pi * (i + 0.5 * (ring % 2)) / count
            for face in (half, -half):
                at = Matrix.Translation((radius * math.cos(angle), radius * math.sin(angle), face))
                grain = Matrix.Diagonal((0.46, 0.46, 0.22, 1.0))
                bmesh.ops.create_icosphere(disc, subdivisions=2, radius=1.0, matrix=at @ grain)
    turn = Matrix.Rotation(math.radians(24), 3, "Z") @ Matrix.Rotation(math.radians(90), 3, "X")
    pose = Matrix.LocRotScale(Vector((-0.20, 0.02, 0.016 + 0.01 * outer)), turn, Vector((0.01,) * 3))
    one_skin(from_bmesh("Jade disc", disc, surface, pose), 0.1, 6)


def soap(surface) -> None:
    """A worn bar of soap."""
    bar = box("Soap", (0.082, 0.05, 0.026), surface, (0.135, -0.175, 0.0132), (0, 0, math.radians(-24)), bevel=0.011)
    smooth = bar.modifiers.new("Smooth", "SUBSURF")
    smooth.levels = smooth.render_levels = 2


def capsule(mesh: bmesh.types.BMesh, a, b) -> None:
    """Add the hull of two spheres (x, y, z, radius)."""
    hull = bmesh.new()
    for x, y, z, radius in (a, b):
        bmesh.ops.create_icosphere(hull, subdivisions=3, radius=radius, matrix=Matrix.Translation((x, y, z)))
    found = bmesh.ops.convex_hull(hull, input=hull.verts[:])
    inside = [item for item in found["geom_interior"] if isinstance(item, bmesh.types.BMVert)]
    bmesh.ops.delete(hull, geom=inside, context="VERTS")
    made = bpy.data.meshes.new("Capsule")
    hull.to_mesh(made)
    hull.free()
    mesh.from_mesh(made)
    bpy.data.meshes.remove(made)


def finger(start, radius, lengths, spread, bends) -> list[tuple]:
    """The joints of a finger, (x, y, z, radius): it bends about y, towards the palm."""
    joints, place, bend = [(*start, radius)], Vector(start), 0.0
    for length, angle in zip(lengths, bends, strict=True):
        bend += math.radians(angle)
        along = Vector((math.cos(bend), 0.0, math.sin(bend)))
        place = place + length * (Quaternion((0, 0, 1), math.radians(spread)) @ along)
        radius *= TAPER
        joints.append((*place, radius))
    return joints


def hand(materials: dict) -> None:
    """A right hand and its forearm: bones in one skin, the nails that the viewer sees, and the cuff of a sleeve."""
    fingers = [finger(*row) for row in KNUCKLES.values()]
    limbs = [FOREARM, THUMB, *fingers]
    limbs += [[(0.4, 0.3 * y, 0.1, 1.7), (x, y, z, 1.05 * radius)] for (x, y, z), radius, *_ in KNUCKLES.values()]
    limbs.append([(1.8, 1.4, 0.9, 1.7), (5.6, 2.2, 0.9, 1.35)])  # ball of the thumb
    limbs.append([(1.8, -1.6, 0.6, 1.5), (6.2, -2.9, 0.6, 1.15)])  # heel of the hand
    skin = bmesh.new()
    for joints in limbs:
        for a, b in itertools.pairwise(joints):
            capsule(skin, a, b)
    # Fingers point to the left and up, the back of the hand to the viewer.
    turn = Matrix(((-1, 0, 0), (0, 0, 1), (0, 1, 0))).to_4x4()
    pose = Matrix.LocRotScale(
        Vector((0.17, -0.03, 0.085)), Matrix.Rotation(math.radians(-10), 3, "Z"), Vector((0.01,) * 3)
    )
    pose = pose @ Matrix.Rotation(math.radians(18), 4, "Y") @ turn
    body = from_bmesh("Hand", skin, materials["Skin"], pose)
    one_skin(body, 0.14, 10)
    nails = bmesh.new()
    for joints in fingers:
        nail(nails, joints)
    from_bmesh("Nails", nails, materials["Nail"], pose)
    cuff = bmesh.new()
    capsule(cuff, (-40.0, -5.0, 0.5, 5.6), (-13.5, -1.2, 0.2, 4.3))
    from_bmesh("Sleeve", cuff, materials["Sleeve"], pose)


def one_skin(item: bpy.types.Object, voxel: float, rounds: int) -> None:
    """Make one smooth surface of all the parts of an object; `voxel` in its own units."""
    remesh = item.modifiers.new("One skin", "REMESH")
    remesh.mode, remesh.voxel_size, remesh.use_smooth_shade = "VOXEL", voxel, True
    smooth = item.modifiers.new("Smooth", "SMOOTH")
    smooth.factor, smooth.iterations = 0.5, rounds


def nail(mesh: bmesh.types.BMesh, joints) -> None:
    """A flat ellipsoid on the back of a finger's last bone."""
    before, tip = Vector(joints[-2][:3]), Vector(joints[-1][:3])
    radius = joints[-1][3]
    along = (tip - before).normalized()
    side = along.cross(Vector((0, 0, -1))).normalized()
    back = side.cross(along)
    frame = Matrix((along, -side, back)).transposed().to_4x4()
    frame.translation = tip + 0.10 * along + 0.78 * radius * back
    shape = Matrix.Diagonal((0.85 * radius, 0.68 * radius, 0.24 * radius, 1.0))
    bmesh.ops.create_icosphere(mesh, subdivisions=4, radius=1.0, matrix=frame @ shape)


def from_bmesh(name: str, shape: bmesh.types.BMesh, surface, pose: Matrix) -> bpy.types.Object:
    """A smooth object of a bmesh, which is freed."""
    mesh = bpy.data.meshes.new(name)
    shape.to_mesh(mesh)
    shape.free()
    mesh.materials.append(surface)
    mesh.shade_smooth()
    result = bpy.data.objects.new(name, mesh)
    result.matrix_world = pose
    bpy.context.scene.collection.objects.link(result)
    return result


def window(scene: bpy.types.Scene) -> None:
    """The light of a window in the evening, from the left and behind."""
    data = bpy.data.lights.new("Window", "AREA")
    data.shape, data.size, data.size_y, data.energy, data.color = "RECTANGLE", 0.7, 1.0, 18.0, (0.55, 0.72, 1.0)
    place(scene, data, (-0.95, 0.35, 0.75), (0.0, 0.0, 0.1))


def lamp(scene: bpy.types.Scene) -> None:
    """A reading lamp behind the viewer's right shoulder."""
    data = bpy.data.lights.new("Lamp", "SPOT")
    data.energy, data.color, data.shadow_soft_size = 10.0, (1.0, 0.78, 0.55), 0.05
    data.spot_size, data.spot_blend = math.radians(60), 0.6
    place(scene, data, (0.55, -0.75, 0.85), (0.0, 0.0, 0.05))


def place(scene: bpy.types.Scene, light: bpy.types.Light, eye, target) -> None:
    """Put a light at `eye` so that it shines at `target`."""
    result = bpy.data.objects.new(light.name, light)
    result.location = eye
    result.rotation_euler = (Vector(target) - Vector(eye)).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(result)
