"""What is read of the frames around the one that is rendered, for motion blur."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from restir_engine import engine  # noqa: E402
from restir_engine.scene.strands import Strands  # noqa: E402
from restir_engine.settings import RenderSettings  # noqa: E402
from restir_engine.sync.depsgraph import read_scene  # noqa: E402
from restir_engine.sync.motion import Frames, moments, steps_of  # noqa: E402
from testing.blender import kit, render  # noqa: E402
from testing.blender.scenes.motion import keyed, shutter, sliding, spinning  # noqa: E402
from testing.blender.scenes.strands import groom  # noqa: E402


@pytest.fixture
def scene():
    return kit.reset()


def read(stop_after: int | None = None):
    """(description, frames that were shown) of the current scene."""
    scene = bpy.context.scene
    shown = []

    def go_to(frame, subframe):
        shown.append(frame + subframe)
        scene.frame_set(frame, subframe=subframe)

    for thing in scene.objects:  # Blender does not notice that Cycles' properties change
        thing.update_tag()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    frames = Frames(go_to, lambda: stop_after is not None and len(shown) >= stop_after)
    return read_scene(depsgraph, RenderSettings(), frames=frames), shown


def places(description) -> dict[int, np.ndarray]:
    """Where instances are at each step, (steps, 3), by their index."""
    return {
        int(index): matrices.reshape(-1, 3, 4)[:, :, 3]
        for group in description.instance_steps
        for index, matrices in zip(group.instances, group.matrices, strict=True)
    }


def test_steps_are_where_the_object_is_at_their_times(scene):
    still = kit.put("cube", kit.diffuse(), (0, 3, 0))
    one, two = (kit.put("cube", kit.diffuse(), (x, 0, 0)) for x in (-1, 1))
    sliding(one), sliding(two)
    two.cycles.motion_steps = 2
    shutter(0.5)
    description, shown = read()
    found = places(description)
    assert len(found) == 2 and len(description.instances) == 3 and still.name
    by_steps = {len(steps): steps for steps in found.values()}
    assert np.allclose(by_steps[3][:, 0], [-1.375, -1.0, -0.625])
    assert np.allclose(by_steps[5][:, 0], 1.0 + 0.375 * np.array([-1, -0.5, 0, 0.5, 1]))
    assert shown == [1.75, 1.875, 2.125, 2.25, 2.0]
    assert scene.frame_current_final == 2.0 and description.shutter is not None
    assert description.camera.steps == ()


@pytest.mark.parametrize(("position", "middle"), [("START", 2.25), ("CENTER", 2.0), ("END", 1.75)])
def test_the_shutter_is_where_its_position_says(scene, position, middle):
    sliding(kit.put("cube", kit.diffuse()))
    shutter(0.5, position)
    description, shown = read()
    (steps,) = places(description).values()
    assert np.allclose(steps[:, 0], 1.5 * (np.array([-0.25, 0.0, 0.25]) + middle - 2.0), atol=1e-6)
    assert np.allclose(description.instances["location"][0, 0], steps[1, 0])
    assert shown[-1] == 2.0 and description.time == 2.0


def test_what_is_switched_off_stands_still(scene):
    own, parent = (kit.put("cube", kit.diffuse(), (x, 0, 0)) for x in (-1, 1))
    sliding(own)
    own.cycles.use_motion_blur = False
    empty = kit.add(None)
    sliding(empty)
    group = bpy.data.collections.new("Group")
    scene.collection.objects.unlink(parent)
    group.objects.link(parent)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    shutter()
    assert len(places(read()[0])) == 1
    empty.cycles.use_motion_blur = False
    assert not places(read()[0])
    empty.cycles.use_motion_blur = True
    empty.cycles.motion_steps = 3
    assert [len(steps) for steps in places(read()[0]).values()] == [9]
    scene.render.use_motion_blur = False
    description, shown = read()
    assert description.shutter is None and not shown
    scene.render.use_motion_blur, bpy.context.view_layer.use_motion_blur = True, False
    assert read()[0].shutter is None


def keyed_shape(thing, factor) -> None:
    """Let an object be as wide as this at frame 3, and as it is at frame 1."""
    thing.shape_key_add(name="Basis")
    key = thing.shape_key_add(name="Wide")
    points = np.empty(3 * len(key.data), np.float32)
    key.data.foreach_get("co", points)
    key.data.foreach_set("co", (points.reshape(-1, 3) * factor).astype(np.float32).ravel())
    keyed(key, "value", {1: 0.0, 3: 1.0})


def test_vertices_and_normals_are_read_at_each_step(scene):
    ball = kit.put("ball", kit.diffuse())
    keyed_shape(ball, (3.0, 1.0, 1.0))
    other = kit.put("ball", kit.diffuse(), (3, 0, 0))
    shutter()
    description, _ = read()
    mesh = description.meshes[description.instances["mesh"][0]]
    assert mesh.steps.shape == (3, len(mesh.vertices) + 2, 3) and mesh.normal_steps.shape[1:] == mesh.normals.shape
    basis = mesh.vertices[:, 0] / 2.0
    for step, width in zip(mesh.steps, (1.5, 2.0, 2.5), strict=True):
        assert np.allclose(step[:-2, 0], basis * width, atol=1e-5)
    assert not np.allclose(mesh.normal_steps[0], mesh.normal_steps[2], atol=0.01)
    assert description.meshes[description.instances["mesh"][1]].steps is None and other.name
    ball.cycles.use_deform_motion = False
    assert all(mesh.steps is None for mesh in read()[0].meshes)


def test_other_vertices_in_other_frames_are_not_blurred_and_named(scene):
    thing = kit.put("cube", kit.diffuse())
    array = thing.modifiers.new("Array", "ARRAY")
    keyed(array, "count", {1: 2, 3: 5})
    shutter(2.0)
    description, _ = read()
    assert all(mesh.steps is None for mesh in description.meshes)
    assert any("blur of its deformation" in line for line in description.warnings.lines())


@pytest.mark.parametrize("children", ["NONE", "SIMPLE", "INTERPOLATED"])
def test_hair_goes_with_its_emitter_from_step_to_step(scene, children):
    """It is where Blender has it at each step; in the emitter's space, which moves as well."""
    thing = kit.put("ball", kit.diffuse())
    keyed_shape(thing, (3.0, 1.0, 1.0))
    sliding(thing)
    still = groom(kit.put("ball", kit.diffuse(), (0, 4, 0)), count=5)
    groom(thing, count=8, child_type=children, rendered_child_count=3, child_percent=3)
    shutter()
    description, _ = read()
    moving, other = (mesh for mesh in description.meshes if isinstance(mesh, Strands))
    assert other.steps is None and still.name
    strands = len(moving)
    for step, frame, subframe in ((0, 1, 0.5), (1, 2, 0.0), (2, 2, 0.5)):
        scene.frame_set(frame, subframe=subframe)
        owner = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
        system, first = owner.particle_systems[0], 0 if children == "NONE" else 8
        count = moving.count // strands + 1
        world = [system.co_hair(owner, particle_no=first + i, step=k) for i in range(strands) for k in range(count)]
        matrix = np.array(owner.matrix_world)
        points = moving.steps[step].reshape(strands, count + 2, 4)[:, 1:-1, :3].reshape(-1, 3)
        assert np.allclose(points @ matrix[:3, :3].T + matrix[:3, 3], world, atol=1e-5)
    assert np.abs(moving.steps[0] - moving.steps[2]).max() > 0.1
    thing.cycles.use_deform_motion = False
    assert all(mesh.steps is None for mesh in read()[0].meshes)


def test_a_velocity_is_a_way_in_a_second(scene):
    thing = kit.put("cube", kit.diffuse())
    velocity = thing.data.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    velocity.data.foreach_set("vector", np.tile([12.0, 0.0, -6.0], 8).astype(np.float32))
    scene.render.fps = 25
    shutter(0.5)
    mesh = read()[0].meshes[0]
    way = np.array([12.0, 0.0, -6.0]) * 0.25 / 25
    assert np.allclose(mesh.steps[:, :-2] - mesh.vertices, np.array([-1, 0, 1])[:, None, None] * way, atol=1e-5)
    thing.cycles.use_deform_motion = False
    assert read()[0].meshes[0].steps is None


def test_instances_are_found_again_when_others_come_and_go(scene):
    """An object that is hidden at one of the times moves the places of those behind it."""
    first, second = (kit.put("cube", kit.diffuse(), (x, 0, 0)) for x in (-1, 1))
    keyed(first, "hide_viewport", {1: True, 2: False}, "CONSTANT")
    sliding(second)
    shutter(0.5)
    description, _ = read()
    assert len(description.instances) == 2
    (steps,) = places(description).values()
    assert np.allclose(steps[:, 0], [1.0 - 0.375, 1.0, 1.0 + 0.375], atol=1e-6)


def test_a_camera_goes_through_its_steps(scene):
    camera = scene.camera
    keyed(camera.data, "lens", {1: 30.0, 3: 60.0})
    spinning(camera, 20.0)
    shutter()
    description, _ = read()
    widths = [step.screen[1] - step.screen[0] for step in description.camera.steps]
    assert np.allclose(widths, [36.0 / lens for lens in (37.5, 45.0, 52.5)])
    camera.cycles.use_motion_blur = False
    assert read()[0].camera.steps == ()


def test_esc_ends_reading_at_the_frame_it_was_at(scene):
    thing = kit.put("cube", kit.diffuse())
    sliding(thing)
    thing.cycles.motion_steps = 4
    shutter()
    description, shown = read(stop_after=3)
    assert len(shown) == 4 and scene.frame_current_final == 2.0
    assert not description.instance_steps and description.commit()


def test_blender_is_left_at_its_frame(scene):
    """A render by the engine itself, of a frame with a fraction."""
    engine.register()
    render.exact_files(scene)
    sliding(kit.put("cube", kit.emission(), (0, 0, 0.5)))
    shutter()
    scene.frame_set(2, subframe=0.25)
    scene.render.resolution_x = scene.render.resolution_y = 8
    render.render("RESTIR", 1, 0)
    assert (scene.frame_current, scene.frame_subframe) == (2, 0.25)


def test_moments_lie_evenly_and_steps_are_those_of_cycles(scene):
    assert [float(moment) for moment in moments(5)] == [-1.0, -0.5, 0.0, 0.5, 1.0]
    thing, parent = kit.add(None), kit.add(None)
    thing.cycles.motion_steps, parent.cycles.motion_steps = 1, 3
    assert steps_of(thing) == (3, True) and steps_of(thing, parent) == (9, True)
    parent.cycles.use_deform_motion = False
    assert steps_of(thing, parent) == (9, False)
