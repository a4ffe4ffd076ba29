"""Displaced and diced meshes: which way vertices go, and that what nothing has changed is not made again."""

import bpy
import numpy as np
import pytest

from restir_engine.scene import displacement
from restir_engine.settings import RenderSettings
from restir_engine.sync import adaptive as by_size
from restir_engine.sync.depsgraph import read_scene
from restir_engine.sync.kept import Kept
from testing.blender import kit
from testing.blender.scenes.displacement import adaptive


@pytest.fixture
def stage():
    return kit.reset()


def read(kept=None):
    """The scene, committed, as the next frame of what is kept."""
    kept = kept or Kept()
    kept.meshes.next_frame()
    kept.trees.next_frame()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return read_scene(depsgraph, RenderSettings(), meshes=kept.meshes).commit(kept.trees)


def raised(height: float):
    """A material that moves vertices up."""

    def build(node):
        up = node("Displacement", Height=height, Midlevel=0.0, Scale=1.0)
        return {"Surface": node("BsdfDiffuse"), "Displacement": up}

    return kit.material(build, displacement_method="DISPLACEMENT")


@pytest.mark.parametrize("smooth", [True, False])
def test_flat_faces_move_along_normals_of_vertices(stage, smooth):
    """As in Cycles, where a flat body keeps whole: a cube's corners go along its diagonals."""
    thing = kit.put("cube", raised(0.3), smooth=smooth)
    mesh = read().meshes[-1]
    assert np.allclose(np.abs(mesh.vertices), 1.0 + 0.3 / np.sqrt(3.0), atol=1e-6)
    monkey = kit.put("monkey", raised(0.3), smooth=smooth)
    bpy.data.objects.remove(thing)
    mesh, data = read().meshes[-1], monkey.data
    points, normals = np.empty((2, len(data.vertices), 3), np.float32)
    data.vertices.foreach_get("co", points.reshape(-1))
    data.vertex_normals.foreach_get("vector", normals.reshape(-1))
    assert np.abs(mesh.vertices - points - 0.3 * normals).max() < 1e-6


@pytest.fixture
def made(monkeypatch):
    """How often meshes have been diced, and displaced."""
    counts = {"diced": 0, "displaced": 0}
    for name, module, function in (("diced", by_size, "subdivided"), ("displaced", displacement, "_displaced")):
        plain = getattr(module, function)

        def counted(*arguments, name=name, plain=plain):
            counts[name] += 1
            return plain(*arguments)

        monkeypatch.setattr(module, function, counted)
    return counts


def changes(thing):
    """What may change between two frames, and whether the mesh is then diced and displaced again."""
    program = thing.data.materials[0].node_tree.nodes["Displacement"].inputs["Scale"]
    camera = bpy.context.scene.camera

    def bend():
        thing.data.vertices[0].co.x += 0.1
        thing.data.update()

    return [
        (lambda: None, (0, 0)),
        (lambda: setattr(program, "default_value", 0.5), (0, 1)),
        (lambda: setattr(thing, "pass_index", 3), (0, 1)),
        (lambda: setattr(camera, "location", (0.0, -4.0, 2.0)), (1, 1)),
        (bend, (1, 1)),
        (lambda: setattr(bpy.context.scene.world, "name", "Other"), (0, 0)),
    ]


def test_what_nothing_has_changed_is_not_made_again(stage, made):
    stage.render.resolution_x = stage.render.resolution_y = 32
    thing = kit.put("monkey", raised(0.1), smooth=True)
    adaptive(thing)
    stage.cycles.preview_dicing_rate = 4.0
    kept = Kept()
    scene = read(kept)
    assert made == {"diced": 1, "displaced": 1}
    for change, (dices, displaces) in changes(thing):
        before = dict(made), scene.meshes[-1]
        change()
        scene = read(kept)
        assert made == {"diced": before[0]["diced"] + dices, "displaced": before[0]["displaced"] + displaces}
        assert (scene.meshes[-1] is before[1]) == (not displaces)
        alone = read()
        assert np.array_equal(alone.meshes[-1].vertices, scene.meshes[-1].vertices)
        made.update({"diced": before[0]["diced"] + dices, "displaced": before[0]["displaced"] + displaces})
