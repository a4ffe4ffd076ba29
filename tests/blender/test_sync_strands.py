"""Reading strands and points: what of Blender's data becomes of them, and when particle hair is read again."""

import bpy
import numpy as np
import pytest

from restir_engine.kernels.core import records as rec
from restir_engine.scene import names
from restir_engine.scene.spheres import Spheres
from restir_engine.scene.strands import Strands
from restir_engine.settings import RenderSettings
from restir_engine.sync.depsgraph import read_scene
from restir_engine.sync.kept import Kept
from testing.blender import kit
from testing.blender.scenes import strands as made


@pytest.fixture
def stage(scene):
    kit.camera()
    return scene


def read(kept=None, asked=()):
    """The shapes of the scene that are not triangles; `asked`: attributes that a program would ask for."""
    kept = kept or Kept()
    for name in asked:
        kept.meshes.attribute_names.setdefault(name, len(kept.meshes.attribute_names))
    found = read_scene(bpy.context.evaluated_depsgraph_get(), RenderSettings(), meshes=kept.meshes)
    return [mesh for mesh in found.meshes if isinstance(mesh, (Strands, Spheres))], found


def value(shape, found, name):
    return shape.attribute(found.attribute_names[name]).values


def test_hair_curves(stage):
    places = made.fur(3, 4)
    hair = made.curves(places, np.arange(12).reshape(3, 4), kit.diffuse())
    made.layer(hair.data, "surface_uv_coordinate", "FLOAT2", "CURVE", np.arange(6))
    asked = (names.INTERCEPT, names.LENGTH, names.STRAND_RANDOM)
    (strands,), found = read(asked=asked)
    assert strands.count == 9 and len(strands) == 3
    points = strands.points.reshape(3, 6, 4)
    np.testing.assert_allclose(points[:, 1:5, :3], places, atol=1e-6)
    np.testing.assert_array_equal(points[:, 1:5, 3], np.arange(12).reshape(3, 4))
    np.testing.assert_array_equal(points[:, [0, 5]], points[:, [1, 4]])
    np.testing.assert_array_equal(strands.record()["shape"], rec.SHAPE_RIBBONS)
    steps = np.linalg.norm(np.diff(places, axis=1), axis=2)
    total = steps.sum(1, keepdims=True)
    share = np.concatenate([np.zeros((3, 1)), np.cumsum(steps, 1) / total], 1)
    np.testing.assert_allclose(value(strands, found, names.INTERCEPT), share.reshape(-1, 1), atol=1e-6)
    np.testing.assert_allclose(value(strands, found, names.LENGTH), total, rtol=1e-6)
    np.testing.assert_array_equal(value(strands, found, names.UV), np.arange(6).reshape(3, 2))
    assert len(np.unique(value(strands, found, names.STRAND_RANDOM))) == 3


@pytest.mark.parametrize(("kind", "shape"), [("RIBBONS", rec.SHAPE_RIBBONS), ("THICK", rec.SHAPE_TUBES)])
def test_shape_and_radius_of_curves(stage, kind, shape):
    """The scene says what curves are drawn as; without a radius it is 5 mm."""
    data = bpy.data.hair_curves.new("Hair")
    data.add_curves([2, 3])
    kit.add(data)
    stage.cycles_curves.shape = kind
    (strands,), _ = read()
    assert strands.record()["shape"] == shape
    np.testing.assert_allclose(strands.points[:, 3], 0.005)


@pytest.mark.parametrize("kind", ["curves", "particles"])
def test_view_layers_show_strands_or_not(stage, kind):
    if kind == "curves":
        made.curves(made.fur(3, 4), 0.1, kit.diffuse())
    else:
        made.furry(count=5)
    assert len(read()[0]) == 1
    stage.view_layers[0].use_strand = False
    assert not read()[0]


def test_point_cloud(stage):
    places, radii = made.cloud(20, 0.1, 0.2)
    made.points(places, radii, kit.diffuse())
    (spheres,), found = read(asked=("tint", names.POINT_RANDOM))
    np.testing.assert_allclose(spheres.points[:, :3], places, atol=1e-6)
    np.testing.assert_allclose(spheres.points[:, 3], radii, rtol=1e-6)
    np.testing.assert_allclose(value(spheres, found, "tint"), np.random.default_rng(3).random((20, 3)), atol=1e-6)
    assert len(np.unique(value(spheres, found, names.POINT_RANDOM))) == 20


def test_particle_hair(stage):
    """Where the depsgraph has the strands, in object space, whatever the emitter's matrix; it need not be shown."""
    thing = made.furry(count=7, radius_scale=0.2, root_radius=1.0, tip_radius=0.5, shape=0.0, use_close_tip=False)
    thing.location, thing.scale = (1.0, 2.0, 3.0), (0.5, 1.0, 2.0)
    thing.show_instancer_for_render = thing.show_instancer_for_viewport = False
    (strands,), found = read()
    assert len(strands) == 7
    owner = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    system, steps = owner.particle_systems[0], strands.count // 7 + 1
    world = np.array([[system.co_hair(owner, particle_no=i, step=k) for k in range(steps)] for i in range(7)])
    matrix = np.array(owner.matrix_world)
    points = strands.points.reshape(7, steps + 2, 4)
    np.testing.assert_allclose(points[:, 1:-1, :3] @ matrix[:3, :3].T + matrix[:3, 3], world, atol=1e-5)
    np.testing.assert_allclose(points[:, 1, 3], 0.1, rtol=1e-6)
    np.testing.assert_allclose(points[:, -1, 3], 0.05, rtol=1e-6)
    np.testing.assert_array_equal(strands.material_slots, 1)
    assert len(found.meshes) == 1


def test_children_stand_for_their_parents(stage):
    """With the share of them that the 3D view shows."""
    made.furry(count=4, child_type="SIMPLE", display_percentage=50, child_percent=10)
    (strands,), _ = read()
    assert len(strands) == 4 * 10 // 2


def test_particle_hair_is_kept(stage):
    """While emitter, settings and strands are the same; its structure is then kept too."""
    thing = made.furry(count=5)
    kept = Kept()
    points = []
    for change in (None, None, "settings", "emitter", None):
        kept.meshes.next_frame()
        if change == "settings":
            thing.particle_systems[0].settings.tip_radius = 0.3
        elif change == "emitter":
            thing.data.vertices[0].co.x += 0.2
            thing.data.update()
        (strands,), _ = read(kept)
        points.append(strands.points)
    assert points[1] is points[0]
    assert points[2] is not points[1] and points[3] is not points[2]
    assert points[4] is points[3]
    np.testing.assert_array_equal(points[2][:, :3], points[1][:, :3])


def test_subsurface_scattering_is_named(stage):
    skin = kit.material(lambda node: node("SubsurfaceScattering"))
    made.curves(made.fur(3, 4), 0.1, skin)
    assert any("subsurface" in line for line in read()[1].warnings.lines())


def test_other_particles_are_no_hair(stage):
    thing = kit.put("cube", kit.diffuse())
    for name in ("objects", "dust"):
        settings = thing.modifiers.new(name, "PARTICLE_SYSTEM").particle_system.settings
        settings.count, settings.type = 5, "EMITTER" if name == "dust" else "HAIR"
        settings.render_type = "OBJECT" if name == "objects" else "PATH"
    assert not read()[0]
