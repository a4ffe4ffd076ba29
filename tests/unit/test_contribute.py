"""All light reaches the film by one door, and the passes that it is told apart by add up to what they are parts of."""

import ast
from pathlib import Path

import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.reuse_settings import ReuseSettings
from restir_engine.scene.mesh import Mesh
from restir_engine.session import Session
from restir_engine.settings import PASSES, RenderSettings
from testing.scenes import media, rooms, scattering
from testing.scenes.lights import matrix
from testing.scenes.shapes import ball

PACKAGE = Path(__file__).resolve().parents[2] / "restir_engine"
DOOR = PACKAGE / "kernels" / "film"
OUTSIDE = sorted(p for p in PACKAGE.rglob("*.py") if DOOR not in p.parents)
SIZES = {"pixels", "width", "height", "channels", "active"}  # of the film: where a pixel is, whether it is sampled
PASS_OFFSETS = set(rec.FILM.names) - SIZES
WRITERS = {"add1", "add3"}  # of kernels.film

HALVES = ("Direct", "Indirect")
LIGHT = [
    f"{lobe} {half}" for lobe in ("Diffuse", "Glossy", "Transmission", "Volume") for half in ("Direct", "Indirect")
]
LIGHT += ["Emission", "Environment"]
SCATTERED = ["Subsurface Boundary", "Subsurface Single", "Subsurface Multiple"]


def writes_past_the_door(tree: ast.AST) -> list[str]:
    """What a module knows of the film's passes or writes to its pixels."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "film":
            if node.attr in PASS_OFFSETS:
                found.append(f"line {node.lineno}: film.{node.attr}")
        elif isinstance(node, ast.ImportFrom):
            found += [f"line {node.lineno}: {a.name}" for a in node.names if a.name in WRITERS]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id.startswith("store"):
            target = {n.attr if isinstance(n, ast.Attribute) else n.id for n in ast.walk(node.args[0])
                      if isinstance(n, ast.Attribute | ast.Name)}  # fmt: skip
            if target & {"film", "pixel", "pixels"}:
                found.append(f"line {node.lineno}: {node.func.id} to a pixel")
    return found


@pytest.mark.parametrize("path", OUTSIDE, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_only_the_film_package_writes_to_the_film(path):
    assert writes_past_the_door(ast.parse(path.read_text())) == []


@pytest.mark.parametrize(
    "line",
    [
        "from ..film.contribute import add3",
        "store_f32(path.pixel, offset, x)",
        "store_f32(film.pixels + 4 * k, 3, x)",
        "store3_f32(pixel, 0, c)",
        "alpha = film.combined + 3",
    ],
)
def test_a_write_past_the_door_is_seen(line):
    assert writes_past_the_door(ast.parse(line))


def medium_scene():
    b = media.stage(0.5)
    media.cube(b, media.medium(0.2, (0.8, 0.6, 0.4), (0.05, 0.0, 0.1), 0.4), size=0.8)
    b.add(rooms.QUAD, rooms.coated((0.6, 0.55, 0.5), 0.4), rooms.scaled(matrix((0.0, 0.0, -0.9)), 4.0, 4.0, 1.0))
    rooms.LIGHTS["area"](b)
    return b.finish(rooms.look((0.4, -3.2, 1.9), (0.0, 0.0, 0.2), 16))


def skin_scene():
    floor = Mesh(*(np.array(a) for a in rooms.QUAD))
    floor.vertices = 3.0 * floor.vertices - np.array([0.0, 0.0, 1.0])
    lamp = rooms.area_lamp(matrix((1.5, -1.5, 2.0), (1.0, -1.0, 1.4)), (60.0, 50.0, 40.0), 0.8, 0.8)
    program = scattering.subsurface_program((0.8, 0.5, 0.4), (0.4, 0.2, 0.1))
    others = [(floor, rooms.coated((0.6, 0.55, 0.5), 0.3))]
    scene = scattering.scatter_scene(Mesh(*ball(1.0, 24)), program, [lamp], 0.3, others)
    return scattering.look(scene, (2.5, -3.0, 1.5), width=16, height=16, size=3.0)


SCENES = {"room": lambda: rooms.picture_scene("all", 16), "medium": medium_scene, "skin": skin_scene}
METHODS = [("PATH", {}), ("PATH", {"sss_method": "HYBRID"}), ("RESTIR", {"reuse": ReuseSettings(pilot=False)})]


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("integrator", "settings"), METHODS, ids=["PATH", "HYBRID", "RESTIR"])
@pytest.mark.parametrize("clamp", [0.0, 0.3])
def test_light_passes_add_up_to_combined(name, integrator, settings, clamp):
    """By the first bounce; and subsurface light by its first scattering. Within the rounding of float32 sums."""
    passes = frozenset(p.name for p in PASSES) - {"Visibility Estimate"}
    limits = {"max_bounces": 5, "volume_bounces": 5, "clamp_direct": clamp, "clamp_indirect": clamp}
    session = Session(SCENES[name](), RenderSettings(integrator, 4, passes=passes, **limits, **settings))
    session.render()
    combined = session.film.sums("Combined")[..., :3]
    assert combined.mean() > 0.1
    total = sum(session.film.sums(p).astype(float) for p in LIGHT)
    np.testing.assert_allclose(total, combined, rtol=1e-5, atol=1e-4)
    scattered = sum(session.film.sums(p).astype(float) for p in SCATTERED)
    np.testing.assert_allclose(scattered, session.film.sums("Subsurface"), rtol=1e-5, atol=1e-4)
    assert (scattered.any(), session.film.sums("Volume Direct").any()) == (name == "skin", name == "medium")
