"""Bakes as Blender asks for them, beside Cycles."""

import bpy
import numpy as np
import pytest

from restir_engine.engine import RestirEngine
from restir_engine.sync import bake
from testing.blender import bakes, kit

SIZE = 32
LOBES = {"DIFFUSE", "GLOSSY", "TRANSMISSION"}


@pytest.fixture(scope="module")
def stage():
    """The body and the floor of the scene, each with an image."""
    body, floor = bakes.stage()
    return {"body": (body, bakes.target(body, SIZE)), "floor": (floor, bakes.target(floor, SIZE))}


def both(item, image, kind, samples, **options):
    """Values (2 seeds, n, 4) by Cycles and by us, of the same pixels."""
    found = [[bakes.bake(engine, item, image, kind, samples, seed, **options) for seed in (1, 2)]
             for engine in ("CYCLES", "RESTIR")]  # fmt: skip
    masks = [each.mask for pair in found for each in pair]
    assert masks[0].any() and all((mask == masks[0]).all() for mask in masks)
    return [np.array([each.values for each in pair], float) for pair in found]


def assert_alike(theirs, ours, by_pixel=True):
    """Means differ by four standard errors at most, and pixels by a tenth more than the noise of both."""
    expected = sum(0.25 * ((pair[0] - pair[1]) ** 2).mean(0) for pair in (theirs, ours))  # variance, by channel
    off = ours.mean(0) - theirs.mean(0)
    assert (np.abs(off.mean(0)) <= 4.0 * np.sqrt(expected / len(off)) + 1e-4).all()
    assert not by_pixel or (off**2).mean() <= 1.25 * expected.mean() + 1e-8


@pytest.mark.parametrize(
    ("name", "kind", "samples"),
    [
        ("body", "POSITION", 1),
        ("body", "ROUGHNESS", 4),
        ("body", "EMIT", 4),
        ("floor", "EMIT", 4),
        ("floor", "NORMAL", 4),
        ("floor", "ENVIRONMENT", 4),
    ],
)
def test_what_has_no_noise_is_equal(stage, name, kind, samples):
    theirs, ours = both(*stage[name], kind, samples, normal_space="OBJECT")
    np.testing.assert_allclose(ours, theirs, atol=2e-5)


@pytest.mark.parametrize(
    ("name", "kind", "parts", "samples"),
    [
        ("floor", "UV", None, 16),
        ("body", "NORMAL", None, 16),
        ("body", "AO", None, 16),
        ("body", "DIFFUSE", {"COLOR"}, 16),
        ("body", "GLOSSY", {"COLOR"}, 16),
        ("body", "TRANSMISSION", {"COLOR"}, 16),
        ("body", "COMBINED", None, 16),
        ("floor", "COMBINED", LOBES | {"INDIRECT", "EMIT", "DIRECT"}, 16),
        ("body", "DIFFUSE", {"DIRECT"}, 16),
        ("body", "GLOSSY", {"DIRECT", "INDIRECT"}, 16),
        ("floor", "SHADOW", None, 16),
    ],
)
def test_what_has_noise_differs_by_no_more(stage, name, kind, parts, samples):
    options = {"pass_filter": parts} if parts else {}
    theirs, ours = both(*stage[name], kind, samples, normal_space="TANGENT", **options)
    assert theirs[..., :3].mean() > 0.01
    # Of light, few samples are most of the noise.
    assert_alike(theirs, ours, by_pixel=kind not in ("SHADOW", "COMBINED", "GLOSSY"))


def test_seen_from_the_camera(stage):
    """Both what looks at it and what does not."""
    body, image = stage["body"]
    bake = bpy.context.scene.render.bake
    bake.view_from = "ACTIVE_CAMERA"
    theirs, ours = both(body, image, "GLOSSY", 16, pass_filter={"COLOR"})
    bake.view_from = "ABOVE_SURFACE"
    above = bakes.bake("RESTIR", body, image, "GLOSSY", 16, pass_filter={"COLOR"}).values
    assert_alike(theirs, ours, by_pixel=False)  # triangles that face away from the shading normal's view differ
    assert abs((above - theirs).mean()) > 10.0 * abs((ours - theirs).mean())


def test_each_image_of_several_materials_gets_its_own(stage):
    floor, image = stage["floor"]
    second = kit.diffuse((0.9, 0.1, 0.1))
    floor.data.materials.append(second)
    mesh = floor.data
    other = bpy.data.images.new("Second", SIZE, SIZE, float_buffer=True)
    node = second.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, second.node_tree.nodes.active = other, node
    cube = kit.put("cube", [*mesh.materials], (4.0, 4.0, 1.0))
    cube.data.polygons[0].material_index = 1
    found = {}
    for engine in ("CYCLES", "RESTIR"):
        bakes.bake(engine, cube, image, "DIFFUSE", 4, pass_filter={"COLOR"})
        values = np.empty(SIZE * SIZE * 4, np.float32)
        other.pixels.foreach_get(values)
        found[engine] = values.reshape(-1, 4)
    bpy.data.objects.remove(cube)
    mesh.materials.pop()
    written = found["CYCLES"][:, 0] > 0.5
    assert written.any() and not written.all()
    np.testing.assert_allclose(found["RESTIR"], found["CYCLES"], atol=1e-3)


def test_what_cannot_be_baked_is_told(stage):
    """By an error; what the artist's image holds stays."""
    floor, image = stage["floor"]
    broken = kit.put("cube", floor.data.materials[0], (5.0, 0.0, 0.0))
    broken.data.vertices[0].co.x = float("nan")
    with pytest.raises(RuntimeError, match=r"cannot be baked: .* triangles"):
        bakes.bake("RESTIR", broken, image, "DIFFUSE", 1)
    bpy.data.objects.remove(broken)


def test_no_camera_and_nothing_is_kept(stage):
    body, image = stage["body"]
    scene = bpy.context.scene
    bpy.ops.render.render()  # whose size Blender's engines then keep
    camera, scene.camera = scene.camera, None
    found = bakes.bake("RESTIR", body, image, "EMIT", 1).values
    scene.camera = camera
    np.testing.assert_allclose(found.mean(0), (0.06, 0.15, 0.03, 1.0), rtol=1e-4)
    assert RestirEngine.kept is None and RestirEngine.baked is None


def test_the_scene_is_read_once_for_several_objects(stage, monkeypatch):
    """By one bake, of what is as in bakes of each; the next one sees what has changed."""
    (body, image), (floor, other) = stage.values()
    alone = bakes.bake("RESTIR", body, image, "COMBINED", 1), bakes.bake("RESTIR", floor, other, "COMBINED", 1)
    read, reads = bake.read_scene, []
    monkeypatch.setattr(bake, "read_scene", lambda *args, **more: reads.append(args) or read(*args, **more))
    lamp = bpy.data.lights[0]
    for is_as_before in (True, False):
        together = bakes.bake("RESTIR", body, image, "COMBINED", 1, selected=[floor]), bakes.pixels(other)
        assert np.array_equal(together[0].values, alone[0].values) == is_as_before
        assert np.array_equal(together[1][alone[1].mask], alone[1].values) == is_as_before
        assert RestirEngine.baked is None

        lamp.energy *= 2.0
    lamp.energy /= 4.0
    assert len(reads) == 2


def test_a_path_begins_outside_of_the_fog_that_the_surface_is_in():
    """And enters the one between it and the lamp."""
    bakes.empty()
    floor = kit.put("plane", kit.diffuse(), scale=1.0)
    image = bakes.target(floor, 16)
    fog = kit.material(lambda node: {"Volume": node("VolumeAbsorption", Density=0.5, Color=(0.2, 0.5, 0.7))})
    kit.put("cube", fog, scale=30.0)
    kit.put("cube", fog, (0.0, 0.0, 1.0), 0.5)
    theirs, ours = both(floor, image, "COMBINED", 16)
    assert_alike(theirs, ours)


@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
def test_color_attributes(domain):
    """Right in the corners of faces, which share their noise."""
    bakes.empty()
    ball = kit.put("coarse ball", kit.diffuse(), (0.0, 3.0, 1.0))
    ball.data.color_attributes.active_color = ball.data.color_attributes.new("Baked", "FLOAT_COLOR", domain)
    places, light = ([bakes.bake_corners(engine, ball, *what) for engine in ("CYCLES", "RESTIR")]
                     for what in (("POSITION", 1), ("DIFFUSE", 256)))  # fmt: skip
    np.testing.assert_allclose(places[1], places[0], atol=5e-4)  # Cycles moves corners a little inwards
    assert np.abs(light[1] - light[0]).max() < 0.02 and abs(np.mean(light[1] - light[0])) < 1e-3


def test_selected_to_active_meets_meshes_and_text():
    """Also one that Cycles and we would subdivide by its size."""
    bakes.empty()
    low = kit.put("coarse ball", kit.diffuse(), (0.0, 3.0, 1.0))
    image = bakes.target(low, 16)
    high = kit.put("coarse ball", kit.diffuse((0.9, 0.2, 0.1)), (0.0, 3.0, 1.0), 1.02)
    modifier = high.modifiers.new("Subdivision", "SUBSURF")
    bpy.context.scene.cycles.dicing_rate = 0.2
    if bpy.app.version >= (5, 0, 0):
        modifier.use_adaptive_subdivision = True
    else:
        bpy.context.scene.cycles.feature_set = "EXPERIMENTAL"
        high.cycles.use_adaptive_subdivision = True
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude = "A", 0.3
    text.materials.append(kit.diffuse((0.1, 0.9, 0.1)))
    letter = kit.add(text, (-0.4, 1.9, 1.0), rotation=(90.0, 0.0, 0.0))
    options = {"selected": [high, letter], "use_selected_to_active": True, "cage_extrusion": 0.4}
    for kind, samples in (("POSITION", 1), ("DIFFUSE", 16)):
        theirs, ours = both(low, image, kind, samples, pass_filter={"COLOR"}, **options)
        assert np.abs(ours.mean(0) - theirs.mean(0)).max() < (1e-4 if samples == 1 else 0.3)
        assert abs((ours - theirs).mean()) < 0.01
    greenish = (ours[0][:, 1] > 0.5).mean()
    assert 0.005 < greenish < 0.5
