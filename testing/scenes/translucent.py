"""Bodies through which light diffuses: a ball, a thin ear, instances, in all of which something may move; and the
scenes of the experiments of benchmarks/restir_sss.py."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from restir_engine.integrators.resampling.history import History
from restir_engine.kernels.core import records as rec
from restir_engine.kernels.lobes.nodes import DIFFUSE, ENTRIES, SUBSURFACE
from restir_engine.kernels.shading import opcodes as ops
from restir_engine.kernels.shading.textures.opcodes import CHECKER
from restir_engine.kernels.subsurface.parameters import METHODS, POSITIVE
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.camera import Camera
from restir_engine.scene.lamps import area_lamp, point_lamp
from restir_engine.scene.scene import Scene
from restir_engine.scene.shaders import Program
from restir_engine.scene.shutter import Shutter
from restir_engine.scene.world import World
from restir_engine.session import Session
from restir_engine.settings import RenderSettings
from testing.scenes.blurred import move, turned
from testing.scenes.lights import matrix
from testing.scenes.rooms import UNSEEN, Builder, checkered, diffuse, look, program, scaled
from testing.scenes.scattering import subsurface_program
from testing.scenes.shapes import OUTWARD, QUAD, icosphere

SKIN = (0.8, 0.5, 0.35), (0.2, 0.08, 0.05)  # colour, radius by channel: mean free paths
MILK = 0.9, 0.87, 0.8  # colour
MOVES = ("lamp", "body", "shape")
STEPS = 3


def skin(scale: float = 1.0, entry: str = "DIFFUSE", g: float = 0.0) -> Program:
    color, radius = SKIN
    return subsurface_program(color, scale * np.array(radius), g, entry=entry)


def checkered_skin(
    size: float,
    entry: str = "DIFFUSE",
    g: float = 0.0,
    scale: float = 1.0,
    contrast: tuple[float, float] = (0.7, 0.4),
    shares: tuple[float, float] = (1.0, 1.0),
) -> Program:
    """Colour and radius (times `scale`) change from square to square along the position, by the factors `contrast`.

    shares: how much of the surface of either kind of square is such; the rest is a grey diffuse one.
    """
    color, radius = np.array(SKIN) * [[1.0], [scale]]
    pairs = [color, contrast[0] * color, radius, contrast[1] * radius]
    pairs += [np.full(3, share) for share in (*shares, *(1.0 - share for share in shares))]
    constants = [*np.concatenate(pairs), size, 1.0, 1.4, 0.5, g, 0.0, 0.5, 0.5, 0.5]
    words = [44, 36, 25, 40, 26, 27, 28, -1, METHODS["RANDOM_WALK"], ENTRIES[entry], POSITIVE]
    checkers = [(CHECKER, 36 + 4 * k, 33, 6 * k, 6 * k + 3, 24) for k in range(4)]
    code = [(ops.GEOMETRY, 33, ops.POINT_POSITION, 0, 29), *checkers, (SUBSURFACE, *words)]
    if min(shares) < 1.0:
        code.append((DIFFUSE, 48, 30, 29, -1))
    return program(code, constants, flags=rec.MATERIAL_SUBSURFACE)


def translucent(step: int = STEPS - 1, moves: str = "", size: int = 64, **entry) -> Scene:
    """The scene at a step of what moves (one of MOVES, "all", "" for none); the last step is the same for all.

    entry: how light enters, and the anisotropy g of what is inside, see `skin`.
    """
    at = {name: step if moves in (name, "all") else STEPS - 1 for name in MOVES}
    b = Builder()
    b.add(QUAD, diffuse((0.5, 0.5, 0.5)), scaled(matrix(), 3.0, 3.0, 1.0))
    vertices, triangles = icosphere(0.45, 4)
    bulge = 1.0 + 0.08 * at["shape"] * np.sin(4.0 * np.asarray(vertices)[:, 2:])
    b.add((np.asarray(vertices) * bulge, triangles), checkered_skin(5.0, **entry), matrix((-0.5, 0.0, 0.45)))
    b.add(
        OUTWARD,
        skin(0.5, **entry),
        scaled(matrix((0.35 + 0.06 * at["body"], 0.1, 0.45), (0.3, -0.2, 1.0)), 0.3, 0.04, 0.4),
    )
    for x in (0.2, 0.65):
        b.add(OUTWARD, skin(0.7, **entry), scaled(matrix((x, -0.55, 0.12), (0.1, x, 1.0)), 0.12, 0.12, 0.12))
    b.add(QUAD, diffuse((0.1, 0.1, 0.1)), scaled(matrix((-0.6, -0.5, 1.3), (0.1, 0.0, 1.0)), 0.35, 0.3, 1.0))
    x = 0.15 * at["lamp"]
    place = matrix((0.4 + x, 1.6, 1.2), (0.1 + x, 1.0, 0.5))
    b.lamp(area_lamp(place, 30.0 * np.ones(3), 0.5, 0.5, key=1, seen_by=UNSEEN))
    b.lamp(point_lamp(matrix((-0.8, -1.2, 2.2)), (24.0, 28.0, 34.0), 0.1, key=2, seen_by=UNSEEN))
    return b.finish(look((0.2, -2.6, 1.5), (0.0, 0.0, 0.4), size))


def ear(b: Builder) -> None:
    """A thin bent sheet of skin with a lamp behind it, and a stick that throws a shadow on its back."""
    line = np.linspace(-1.0, 1.0, 33)
    x, z = (a.ravel() for a in np.meshgrid(line, line))
    front = np.column_stack([0.8 * x, 0.25 * (x**2 + z**2) - 0.03 * (2.0 - x**2 - z**2), 0.8 * z])
    back = np.column_stack([0.8 * x, 0.25 * (x**2 + z**2) + 0.03 * (2.0 - x**2 - z**2), 0.8 * z])
    corner = (np.arange(32)[:, None] * 33 + np.arange(32)).ravel()
    up = [t for c in corner for t in ((c, c + 1, c + 34), (c, c + 34, c + 33))]
    triangles = up + [tuple(k + 33 * 33 for k in t[::-1]) for t in up]
    b.add((np.concatenate([front, back]), triangles), skin(0.6), matrix())
    b.add(OUTWARD, diffuse((0.2, 0.2, 0.2)), scaled(matrix((0.1, 0.7, 0.0), (0.5, 0.0, 1.0)), 0.05, 0.05, 1.2))
    b.lamp(area_lamp(matrix((0.3, 3.0, 0.5), (0.1, 1.0, 0.2)), 200.0 * np.ones(3), 0.3, 0.3, seen_by=UNSEEN))


def glass(color, length: float, entry: str = "DIFFUSE") -> Callable[[Builder], None]:
    """A plate, half as thick as that mean free path, with a lamp behind it and a stick that throws a shadow."""

    def build(b: Builder) -> None:
        program = subsurface_program(color, length * np.array([1.0, 0.8, 0.6]), entry=entry)
        b.add(OUTWARD, program, scaled(matrix(), 0.8, 0.25 * length, 0.8))
        b.add(OUTWARD, diffuse((0.2, 0.2, 0.2)), scaled(matrix((0.1, 0.7, 0.0), (0.5, 0.0, 1.0)), 0.05, 0.05, 1.2))
        b.lamp(area_lamp(matrix((0.3, 3.0, 0.5), (0.1, 1.0, 0.2)), 200.0 * np.ones(3), 0.3, 0.3, seen_by=UNSEEN))

    return build


def under_textured_light(b: Builder) -> None:
    """A plate of milk glass under a checkered sky."""
    program = subsurface_program(MILK, (0.2, 0.16, 0.12), entry="DIFFUSE")
    b.add(OUTWARD, program, scaled(matrix(), 0.8, 0.05, 0.8))
    b.scene.world = World(material=b.scene.shaders.add(checkered((2.0, 1.0, 0.4), (0.05, 0.1, 0.3), 1.7)), map_width=64)


def wide_lamp(b: Builder) -> None:
    """A plate of milk glass before a lamp that half of all directions lead to."""
    program = subsurface_program(MILK, (0.2, 0.16, 0.12), entry="DIFFUSE")
    b.add(OUTWARD, program, scaled(matrix(), 0.8, 0.15, 0.8))
    b.lamp(area_lamp(matrix((0.3, 1.5, 0.5), (0.1, 1.0, 0.2)), 60.0 * np.ones(3), 5.0, 5.0, seen_by=UNSEEN))


def turning_plate(size: int) -> Scene:
    """A plate of milk glass that turns while the shutter is open, a lamp and a still stick behind it; committed."""
    b = Builder()
    glass(MILK, 0.2)(b)
    scene = b.describe(view_at(0.0, size))
    move(scene, {0: [turned(0.3 * k, (0.1 * k, 0.0, 0.0), 0.8, 0.05, 0.8) for k in (-1, 0, 1)]})
    scene.shutter = Shutter(np.ones(3))
    return scene.commit()


def _ball(b: Builder) -> None:
    b.add(icosphere(0.9, 4), skin(), matrix())


def many_lights(b: Builder) -> None:
    """A ball among two hundred coloured points."""
    _ball(b)
    random = np.random.default_rng(4)
    for color, way in zip(random.random((200, 3)), random.normal(size=(200, 3)), strict=True):
        place = way / np.linalg.norm(way) * (1.3 + 0.7 * random.random())
        b.lamp(point_lamp(matrix(place), 0.6 * color, 0.02, seen_by=UNSEEN))


def large_light(b: Builder) -> None:
    """A ball under a lamp that is larger than it."""
    _ball(b)
    b.lamp(area_lamp(matrix((0.5, -0.8, 2.2), (0.2, -0.4, 1.0)), 60.0 * np.ones(3), 2.5, 2.5, seen_by=UNSEEN))


def shadow(b: Builder) -> None:
    """A ball on which a card's sharp shadow ends."""
    _ball(b)
    b.add(QUAD, diffuse((0.2, 0.2, 0.2)), scaled(matrix((-0.55, -1.4, 1.25), (-0.5, -1.0, 0.5)), 0.5, 0.9, 1.0), UNSEEN)
    b.lamp(point_lamp(matrix((-1.6, -3.2, 1.8)), 120.0 * np.ones(3), 0.03, seen_by=UNSEEN))


def dragon(b: Builder) -> None:
    """A dragon of 202,520 triangles in front of one large lamp and before another."""
    lines = (Path(os.environ["RESTIR_ASSETS"]) / "stanford" / "dragon_vrip_res2.ply").read_text().splitlines()
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    first = lines.index("end_header") + 1
    x, y, z = np.array([line.split() for line in lines[first : first + count]], float).T
    vertices = 9.0 * np.column_stack([x, -z, y - 0.12])
    triangles = np.array([line.split()[1:] for line in lines[first + count :] if line], np.int32)
    b.add((vertices, triangles), skin(), matrix())
    b.lamp(area_lamp(matrix((0.5, -0.8, 2.2), (0.2, -0.4, 1.0)), 60.0 * np.ones(3), 1.0, 1.0, seen_by=UNSEEN))
    b.lamp(area_lamp(matrix((0.3, 3.0, 0.5), (0.1, 1.0, 0.2)), 100.0 * np.ones(3), 0.5, 0.5, seen_by=UNSEEN))


class Experiment(NamedTuple):
    """What is added to a scene, and where it is seen from near: side of the whole picture, part of it in the middle."""

    add: Callable[[Builder], None]
    whole: int = 0  # pixels; 0: the picture is the whole
    middle: tuple[float, float] = (0.5, 0.5)


EXPERIMENTS: dict[str, Experiment] = {
    "thin ear": Experiment(ear),
    "many lights": Experiment(many_lights),
    "large light": Experiment(large_light),
    "shadow boundary": Experiment(shadow),
    "shadow, near": Experiment(shadow, 1280, (0.36, 0.5)),
    "dragon": Experiment(dragon),
}
if "RESTIR_ASSETS" not in os.environ:
    del EXPERIMENTS["dragon"]
# Of light that crosses straight.
CROSSED: dict[str, Callable[[Builder], None]] = {
    "thin ear": ear,
    "milk glass": glass(MILK, 0.2),
    "dark glass": glass((0.25, 0.4, 0.15), 0.2),
    "textured light": under_textured_light,
    "wide lamp": wide_lamp,
    "refractive entry": glass(MILK, 0.2, "REFRACTIVE"),
    "skin's entry": glass(MILK, 0.2, "SKIN"),
}


def camera_at(name: str, turn: float, size: int) -> Camera:
    """A close-up of one of EXPERIMENTS from in front, `turn` degrees to the side."""
    camera = view_at(turn, size)
    whole, middle = EXPERIMENTS[name][1:]
    if not whole:
        return camera
    corner = (round(whole * at - size / 2) for at in middle)
    return replace(camera, width=whole, height=whole, region=(*corner, size, size))


def view_at(turn: float, size: int, distance: float = 2.6) -> Camera:
    """A view from in front, `turn` degrees to the side."""
    angle = math.radians(turn)
    place = np.array([math.sin(angle), -math.cos(angle), 0.4 / 2.6])
    return look(distance * place, (0.0, 0.0, 0.0), size)


def experiment(name: str, size: int) -> Scene:
    """One of EXPERIMENTS, committed."""
    b = Builder()
    EXPERIMENTS[name].add(b)
    return b.finish(camera_at(name, 0.0, size))


def crossed(name: str, size: int, distance: float = 2.6) -> Scene:
    """One of CROSSED, committed."""
    b = Builder()
    CROSSED[name](b)
    return b.finish(view_at(0.0, size, distance))


class Light(NamedTuple):
    """What a render has found of the direct light from below surfaces."""

    rgb: np.ndarray  # float64 (height, width, 3)
    parts: list[np.ndarray]  # several such, of which that is the first
    seconds: float  # of the processor, without what compiles and builds
    history: History | None


def subsurface_light(
    scene: Scene, samples: int, camera=None, history=None, parts: Sequence[str] = ("Subsurface",), **settings
) -> Light:
    """Render so many samples on one thread, by DIFFUSION and RESTIR where `settings` do not say otherwise.

    parts: the passes that are returned.
    """
    passes = frozenset({"Combined", *parts})
    reuse = ReuseSettings(pilot=False)
    defaults = {
        "integrator": "RESTIR",
        "reuse": reuse,
        "sss_method": "DIFFUSION",
        "sss_shift": "NONE",
        "max_bounces": 0,
        "threads": 1,
        "passes": passes,
    }
    session = Session(scene, RenderSettings(samples=samples, **defaults | settings), camera, history)
    session.prepare()
    start = time.process_time()
    assert session.render()
    seconds = time.process_time() - start
    found = [session.film.pass_array(part)[..., :3].astype(float) for part in parts]
    return Light(found[0], found, seconds, session.history)
