"""Lamps of every kind and size, and scenes of one kind of light each; all shine on the origin."""

from restir_engine.scene.description import SceneDescription
from restir_engine.scene.lamps import area_lamp, point_lamp, portal, spot_lamp, sun_lamp
from restir_engine.scene.scene import Scene
from restir_engine.scene.world import World

from .lights import emission_program, lamp_scene, matrix, mesh_description

WHITE = (1.0, 1.0, 1.0)
UP = (0.0, 0.0, 1.0)
DOWN = matrix((0.2, -0.1, 2.0), (0.1, 0.0, 1.0))  # shines along -z of this, towards the origin
ASIDE = matrix((1.5, 0.5, 1.0), (0.6, 0.3, 1.0))
PORTALS = (portal(DOWN, 1.0, 2.0), portal(ASIDE, 1.5, 1.5, ellipse=True), portal(matrix((0.0, 0.0, -3.0)), 1.0, 1.0))
# (name, lamp, points from which it is sampled)
LAMPS = {
    "point disk": point_lamp(DOWN, WHITE, 0.7),
    "point sphere": point_lamp(DOWN, WHITE, 0.7, soft=False),
    "spot disk": spot_lamp(DOWN, WHITE, 0.4, 0.9, 0.5),
    "spot sphere": spot_lamp(DOWN, WHITE, 0.7, 1.2, 0.5, soft=False),
    "spot narrow": spot_lamp(DOWN, WHITE, 1.0, 0.3, 0.2, soft=False),
    "spot stretched": spot_lamp(DOWN * [2.0, 0.5, 1.0, 1.0], WHITE, 0.5, 0.8, 0.5, soft=False),
    "area rectangle": area_lamp(DOWN, WHITE, 2.0, 1.0),
    "area aside": area_lamp(ASIDE, WHITE, 3.0, 2.0),
    "area disk": area_lamp(DOWN, WHITE, 1.5, 1.5, ellipse=True),
    "area ellipse": area_lamp(DOWN, WHITE, 2.5, 1.0, ellipse=True),
    "area scaled": area_lamp(DOWN * [2.0, 0.5, 1.0, 1.0], WHITE, 1.0, 1.0),
    "area spread": area_lamp(DOWN, WHITE, 2.0, 1.5, spread=0.6),
    "area disk spread": area_lamp(DOWN, WHITE, 2.0, 2.0, ellipse=True, spread=0.5),
    "area ellipse spread": area_lamp(DOWN, WHITE, 2.0, 3.0, ellipse=True, spread=1.5),
    "area distant": area_lamp(matrix((0.0, 0.0, 900.0)), WHITE, 1e-3, 2e-3),
    "sun": sun_lamp(DOWN, WHITE, 0.5),
    "sun small": sun_lamp(DOWN, WHITE, 0.00918),
}


POINTS = [(0.0, 0.0, 0.0), (0.6, 0.3, 0.9)]
ABOVE = matrix((0.0, 0.0, 2.0))
DELTAS = {
    "point": point_lamp(ABOVE, WHITE, 0.0),
    "spot": spot_lamp(ABOVE, WHITE, 0.0, 1.5, 0.2),
    "sun delta": sun_lamp(ABOVE, WHITE, 0.0),
    "beam": area_lamp(ABOVE, WHITE, 3.0, 2.0, spread=0.0),
}


def quad_description() -> SceneDescription:
    """A quad and a far triangle that emit, in two placements, one mirrored."""
    vertices = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (60, 60, 0), (62, 60, 1), (60, 61, 0)]
    matrices = [matrix((0.5, 0.2, 2.0), (0.3, 0.1, 1.0)), matrix((-2.0, 0.0, 1.0)) * [-1.0, 0.7, 1.0, 1.0]]
    program = emission_program((2.0, 1.0, 0.5))
    return mesh_description(vertices, [(0, 1, 2), (0, 2, 3), (4, 5, 6)], program, matrices)


def quad() -> Scene:
    """The same, committed."""
    return quad_description().commit()


def sky(portals=()) -> Scene:
    """A world of constant radiance that is sampled by a map, and through portals."""
    scene = SceneDescription()
    scene.lights.portals += portals
    scene.world = World(material=scene.shaders.add(emission_program((1.0, 2.0, 3.0))), map_width=32)
    return scene.commit()


SCENES = {name: (lambda lamp=lamp: lamp_scene(lamp)) for name, lamp in (LAMPS | DELTAS).items()} | {
    "triangles": quad,
    "world": sky,
    "portals": lambda: sky(PORTALS),
    "all": lambda: lamp_scene(*LAMPS.values(), *DELTAS.values()),
}
