"""Passes of light groups beside Cycles': the same mean light of each group, adding up to Combined in every pixel."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from testing.blender import exr, kit, render  # noqa: E402
from testing.blender.registry import Scene  # noqa: E402
from testing.blender.scenes.light import subject  # noqa: E402

SEEDS, SAMPLES, BOUND, ERRORS = 4, 48, 0.005, 3.0


@pytest.fixture(scope="module", autouse=True)
def registered():
    render.register()


def member(thing, group: str):
    thing.lightgroup = group
    return thing


def emitter(color, strength: float, where, size: float, **placing):
    return kit.put("plane", kit.emission(color, strength), where, size, target=(0.0, 0.0, 0.5), **placing)


def lamps():
    """One or two of all kinds in a group, and an instance of a collection, whose object has no group of its own."""
    subject()
    member(kit.light("POINT", 60, (-0.4, -1.6, 1.9), shadow_soft_size=0.3, color=(1, 0.8, 0.5)), "round")
    member(kit.light("SPOT", 700, (-2.5, -2, 3.5), spot_size=math.radians(50), shadow_soft_size=0.0), "round")
    member(kit.light("SUN", 1.0, (3, -1, 2), angle=0.1, color=(1, 0.6, 0.3)), "far")
    lamp = kit.lamp(150)
    bpy.context.scene.collection.objects.unlink(lamp)
    collection = bpy.data.collections.new("Collection")
    collection.objects.link(lamp)
    empty = member(kit.add(None), "instanced")
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    return "round", "far", "instanced"


def transparent():
    """A world, a mesh that emits and a glowing medium, before nothing."""
    subject()
    bpy.data.objects["plane"].scale = (1.5, 1.5, 1.0)
    member(kit.hdri("courtyard", 1.0, 70.0), "world")
    member(emitter((1.0, 0.3, 0.1), 12.0, (-1.5, -1.0, 2.5), 0.5), "glow")
    medium = kit.material(lambda node: {"Volume": node("Emission", Color=(0.1, 0.4, 1.0, 1.0), Strength=1.0)})
    member(kit.put("cube", medium, (1.5, -1.0, 0.4), 0.35), "glow")
    bpy.context.scene.render.film_transparent = True
    return "world", "glow"


def company():
    """Hair, a medium that glows, and scattering below a surface, under lamps, a mesh that emits and the world."""
    subject()
    member(kit.light("POINT", 100, (-2.5, -2.0, 3.0), shadow_soft_size=0.3), "fill")
    member(kit.lamp(200), "key")
    member(kit.world(lambda node: node("Background", Color=(0.1, 0.15, 0.2))), "world")
    member(kit.put("cube", kit.emission((1.0, 0.6, 0.3), 6.0), (-1.6, -1.2, 0.3), 0.25), "fill")
    roots = np.random.default_rng(1).normal(size=(200, 3))
    roots /= np.linalg.norm(roots, axis=1, keepdims=True)
    points = np.array((1.5, -0.8, 0.6)) + roots[:, None] * np.linspace(0.3, 0.6, 4)[:, None]
    hair = bpy.data.hair_curves.new("Hair")
    hair.add_curves([4] * len(roots))
    hair.position_data.foreach_set("vector", points.astype(np.float32).ravel())
    hair.materials.append(kit.material(lambda node: node("BsdfHairPrincipled")))
    kit.add(hair)
    fire = {"Density": 0.5, "Emission Strength": 0.4, "Emission Color": (0.2, 0.5, 1.0)}
    medium = kit.material(lambda node: {"Volume": node("VolumePrincipled", **fire)})
    member(kit.put("cube", medium, (-0.4, -1.6, 0.5), 0.4), "key")
    wax = kit.principled(Base_Color=(0.8, 0.4, 0.3, 1.0), Subsurface_Weight=1.0, Subsurface_Scale=0.2)
    kit.put("ball", wax, (0.6, -1.8, 0.4), 0.4)
    return "fill", "key", "world"


def catcher():
    """A floor that is there for shadows alone; what it shows of them belongs to no group."""
    groups = company()
    bpy.data.objects["plane"].is_shadow_catcher = True
    return groups


def passes(engine: str, seed: int, path) -> dict[str, np.ndarray]:
    """Combined and its parts by light group, float32 (height, width, 3)."""
    scene = bpy.context.scene
    scene.render.engine, scene.render.filepath = engine, str(path)
    for settings in (scene.cycles, scene.restir):
        settings.samples, settings.seed = SAMPLES, seed
    with render.quiet():
        bpy.ops.render.render(write_still=True)
    found = exr.channels(path)
    names = {name.split(".")[-2] for name in found if name.split(".")[-2].startswith("Combined")}
    layer = bpy.context.view_layer.name
    return {name: np.stack([found[f"{layer}.{name}.{c}"] for c in "RGB"], 2) for name in names}


def means(images) -> tuple[np.ndarray, np.ndarray]:
    """Mean by channel and its standard error, of the renders of several seeds."""
    by_seed = np.array([image.mean((0, 1)) for image in images], float)
    return by_seed.mean(0), by_seed.std(0, ddof=1) / math.sqrt(len(by_seed))


def differences(ours, theirs) -> dict[str, float]:
    """By pass: by how many standard errors the relative difference of the means is above BOUND."""
    found = {}
    for name in theirs[0]:
        (a, error_a), (b, error_b) = means([one[name] for one in ours]), means([one[name] for one in theirs])
        excess = np.abs(a - b) - BOUND * b
        found[name] = float((excess / np.hypot(error_a, error_b)).max())
    return found


@pytest.mark.parametrize(
    "build", [lamps, transparent, *(pytest.param(build, marks=pytest.mark.deep) for build in (company, catcher))]
)
@pytest.mark.parametrize("integrator", ["PATH", "RESTIR"])
def test_each_group_has_the_light_that_it_has_in_cycles(build, integrator, tmp_path):
    groups = []
    render.prepare(Scene(build.__name__, lambda: groups.extend(build()), 1, SAMPLES, (64, 36)))
    scene = bpy.context.scene
    scene.restir.integrator, scene.restir.reuse.pilot = integrator, False
    for name in groups:
        bpy.context.view_layer.lightgroups.add(name=name)
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    theirs = [passes("CYCLES", seed, tmp_path / "image.exr") for seed in range(SEEDS)]
    ours = [passes("RESTIR", seed, tmp_path / "image.exr") for seed in range(SEEDS)]
    assert set(ours[0]) == set(theirs[0]) == {"Combined", *(f"Combined_{name}" for name in groups)}
    for one in ours + theirs if build is not catcher else ():
        np.testing.assert_allclose(sum(one[f"Combined_{name}"] for name in groups), one["Combined"], atol=1e-4)
    found = differences(ours, theirs)
    assert max(found.values()) < ERRORS, found
    planted = [one | {f"Combined_{groups[0]}": 1.05 * one[f"Combined_{groups[0]}"]} for one in ours]
    assert max(differences(planted, theirs).values()) > ERRORS
