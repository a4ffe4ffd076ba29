"""Volume objects and smoke domains as they are read: values, places, files that are not there."""

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from restir_engine.scene.description import SceneDescription  # noqa: E402
from restir_engine.scene.recent import Recent  # noqa: E402
from restir_engine.scene.voxels import VoxelAttribute, box_mesh  # noqa: E402
from restir_engine.sync import volumes, voxels  # noqa: E402
from restir_engine.sync.materials import Materials  # noqa: E402
from restir_engine.sync.nodes import compiler  # noqa: E402
from restir_engine.sync.nodes.proportional import proportional_to  # noqa: E402
from restir_engine.sync.volumes import density_factors, read_domain, read_volume  # noqa: E402
from testing.blender import kit, render  # noqa: E402
from testing.blender.registry import Scene  # noqa: E402
from testing.blender.scenes.smoke import cloud  # noqa: E402


def evaluated(thing):
    return thing.evaluated_get(bpy.context.evaluated_depsgraph_get())


def asking(*names) -> SceneDescription:
    scene = SceneDescription()
    for name in names:
        scene.attribute_name(name)
    return scene


@pytest.fixture
def smoke():
    kit.reset()
    return cloud(kit.material(lambda node: {"Volume": node("VolumePrincipled")}), n=12)


def test_voxels_are_read_at_their_places(smoke):
    """Twelve, fifteen and seven voxels from -1 to 1, whatever Blender says of where its voxels lie."""
    scene = asking("density")
    before = [len(getattr(bpy.data, name)) for name in ("objects", "volumes", "scenes", "node_groups", "meshes")]
    mesh = read_volume(scene, evaluated(smoke), Recent())
    after = [len(getattr(bpy.data, name)) for name in ("objects", "volumes", "scenes", "node_groups", "meshes")]
    assert before == after and not len(scene.warnings)
    (grid,) = mesh.attributes
    assert grid.values.shape == (13, 17, 9, 1)  # where x is -1 there is nothing
    index = np.stack(np.meshgrid(*(np.arange(n) for n in grid.values.shape[:3]), indexing="ij"), -1).reshape(-1, 3)
    places = index @ grid.to_object[:, :3].T + grid.to_object[:, 3]
    inside = (np.abs(places) <= 1.0 + 1e-5).all(1)
    x, y, z = places.T
    expected = np.where(inside, ((1.0 + x) * (2.0 + y) * (3.0 + z) / 24.0) ** 2, 0.0)
    assert grid.values.ravel() == pytest.approx(expected, abs=1e-5)


def test_a_file_is_read_once_and_its_grids_are_kept(smoke, tmp_path, monkeypatch):
    path = str(tmp_path / "cloud.vdb")
    volume = evaluated(smoke).data
    volume.grids.load()
    assert volume.grids.save(filepath=path)
    data = bpy.data.volumes.new("File")
    data.filepath = path
    thing = kit.add(data)
    kept = Recent()
    first = read_volume(asking("density"), evaluated(thing), kept)
    monkeypatch.setattr(voxels, "_by_nodes", None)
    again = read_volume(asking("density"), evaluated(thing), kept)
    assert first.attributes[0].values == pytest.approx(again.attributes[0].values)


@pytest.mark.parametrize("error", [voxels.Unreadable("its grids cannot be saved"), OSError("no space left")])
def test_what_cannot_be_saved_is_left_out_and_named(smoke, monkeypatch, error):
    def fails(volume):
        raise error

    monkeypatch.setattr(volumes, "saved", fails)
    scene = asking("density")
    assert read_volume(scene, evaluated(smoke), Recent()) is None
    assert any("is not rendered" in line and str(error) in line for line in scene.warnings.lines())


def test_what_cannot_be_read_is_named(smoke, monkeypatch):
    data = bpy.data.volumes.new("Gone")
    data.filepath = "//gone.vdb"
    scene = asking("density")
    assert read_volume(scene, evaluated(kit.add(data)), Recent()) is None
    assert "Gone" in scene.warnings.lines()[0] and "gone.vdb" in scene.warnings.lines()[0]
    monkeypatch.setattr(voxels, "KINDS", {})
    assert read_volume(scene, evaluated(smoke), Recent()) is None
    assert "density" in scene.warnings.lines()[1] and "float" in scene.warnings.lines()[1]
    assert read_volume(asking("flame"), evaluated(smoke), Recent()) is None


def test_a_smoke_domain_fills_the_texture_space_of_its_mesh():
    kit.reset()
    thing = kit.put("cube", None)
    density = np.arange(24, dtype=np.float32)
    fine = np.arange(4 * 8 * 24, dtype=np.float32)

    class Values(list):
        def foreach_get(self, target):
            target[:] = self

    domain = SimpleNamespace(
        domain_resolution=(2, 3, 4), noise_scale=2, density_grid=Values(density), color_grid=Values(fine),
        flame_grid=[], heat_grid=[0.0] * 7, temperature_grid=[], velocity_grid=[],
    )  # fmt: skip
    scene = asking("density", "color", "flame", "heat")
    mesh = read_domain(scene, thing, domain)
    grids = {grid.name: grid for grid in mesh.attributes}
    smoke, color = grids[scene.attribute_name("density")], grids[scene.attribute_name("color")]
    assert smoke.values[1, 1, 1, 0] == 0.0 and smoke.values[2, 1, 1, 0] == 1.0 and smoke.values[1, 2, 1, 0] == 2.0
    # The first voxel's centre is half an edge from the corner of the texture space, here that of the mesh.
    assert smoke.to_object @ (1.0, 1.0, 1.0, 1.0) == pytest.approx([-0.5, -1.0 + 1.0 / 3.0, -0.75])
    assert color.values.shape == (6, 8, 10, 4)
    assert len(grids) == 2 and "heat" in scene.warnings.lines()[0]


def test_density_in_object_space_counts_by_the_length_of_the_diagonal():
    stretched = np.column_stack([np.diag((1.0, 2.0, 2.0)), np.ones(3)])
    matrices = np.array([np.eye(3, 4).ravel(), 3.0 * np.eye(3, 4).ravel(), stretched.ravel()])
    assert density_factors(matrices) == pytest.approx([1.0, 1.0 / 3.0, 1.0 / np.sqrt(3.0)])


def test_boxes_look_outwards():
    for mirror in (1.0, -1.0):
        grid = VoxelAttribute(0, np.zeros((3, 4, 5)), np.column_stack([np.diag((mirror, 2.0, 1.0)), np.zeros(3)]))
        mesh = box_mesh("Box", [grid])
        a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
        outwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - mesh.vertices.mean(0))
        assert len(outwards) == 12 and np.all(outwards > 0.0)


def test_what_is_proportional_to_one_grid_is_rendered_without_its_program(monkeypatch):
    """Its mean is the same, within four of its errors. Other programs are told apart."""

    def build():
        def twice(node):
            density = node("Math", {0: node("VolumeInfo").outputs["Density"], 1: 8.0}, operation="MULTIPLY")
            return node("AddShader", {0: node("VolumeScatter", Density=density, Anisotropy=0.4),
                                      1: node("VolumeAbsorption", Density=density, Color=(0.9, 0.5, 0.2))})  # fmt: skip

        kit.world(lambda node: node("Background", Strength=1.0))
        kit.light("SUN", 2.0, (2.0, -2.0, 3.0))
        cloud(kit.material(lambda node: {"Volume": twice(node)}), n=12)

    def means():
        render.prepare(Scene("proportional", build, 1, 1, (24, 16), {"volume_bounces": 2}))
        with render.quiet():
            return np.stack([render.render("RESTIR", 16, seed)[..., :3].mean((0, 1)) for seed in range(4)])

    render.register()
    found = []
    monkeypatch.setattr(compiler, "proportional_to", lambda *given: found.append(proportional_to(*given)) or found[-1])
    quick = means()
    monkeypatch.setattr(compiler, "proportional_to", lambda *_: -1)
    assert max(found) >= 0
    slow = means()
    error = np.hypot(quick.std(0, ddof=1), slow.std(0, ddof=1)) / 2.0
    assert np.all(error < 0.005 * slow.mean(0)), error
    assert np.all(np.abs(quick.mean(0) - slow.mean(0)) < 4.0 * error), (quick.mean(0), slow.mean(0), error)


@pytest.mark.parametrize(
    ("inputs", "expected"),
    [({}, True), ({"Emission Strength": 1.0}, False), ({"Blackbody Intensity": 0.5}, False), ({"Density": 0.0}, True)],
)
def test_which_media_are_proportional(inputs, expected):
    kit.reset()
    material = kit.material(lambda node: {"Volume": node("VolumePrincipled", inputs)})
    scene = SceneDescription()
    program = scene.shaders[Materials(scene).index(material, in_grids=True)]
    assert (program.medium_grid >= 0) == expected
