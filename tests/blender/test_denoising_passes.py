"""What guides a denoiser beside Cycles: of surfaces that mirror or let through by degrees, what is seen in them."""

import bpy
import numpy as np
import pytest

from testing.blender import exr, kit
from testing.blender.render import exact_layers, register

SAMPLES = 256


def materials():
    """From a mirror over ever rougher metal to what does not mirror; half of it transparent, or diffuse; glass."""

    def glossy(node, roughness):
        return node("BsdfGlossy", Color=(0.9, 0.5, 0.2), Roughness=roughness)

    def mixed(node, a, b, share):
        return node("MixShader", {0: share, 1: a, 2: b})

    for roughness in (0.0, 0.1, 0.24, 0.3, 0.5):
        yield kit.material(lambda node, r=roughness: glossy(node, r))
    yield kit.diffuse((0.8, 0.2, 0.1))
    yield kit.material(lambda node: mixed(node, node("BsdfTransparent"), node("BsdfDiffuse"), 0.4))
    yield kit.material(lambda node: mixed(node, node("BsdfTransparent"), glossy(node, 0.24), 0.5))
    yield kit.material(lambda node: mixed(node, glossy(node, 0.1), node("BsdfDiffuse"), 0.4))
    yield kit.material(lambda node: node("BsdfGlass", Color=(0.9, 0.8, 0.7), Roughness=0.0))


@pytest.fixture(scope="module")
def scene():
    """A pixel of each material between a diffuse floor and a ceiling, as seen from above."""
    register()
    scene = kit.reset()
    found = list(materials())
    for i, material in enumerate(found):
        kit.put("plane", material, (i + 0.5, 0, 0), (0.5, 8.0, 1.0))
    middle = len(found) / 2
    kit.put("plane", kit.diffuse((0.3, 0.6, 0.9)), (middle, 0, -1), 200.0)
    kit.put("plane", kit.diffuse((0.7, 0.7, 0.7)), (middle, 0, 10), 200.0, rotation=(180, 0, 0))
    kit.camera((middle, 0, 3), type="ORTHO", ortho_scale=len(found)).rotation_euler = (0.0, 0.0, 0.0)
    exact_layers(scene)
    scene.render.resolution_x, scene.render.resolution_y = len(found), 4
    layer = bpy.context.view_layer
    layer.cycles.denoising_store_passes = layer.restir.use_pass_denoising = True
    scene.cycles.use_denoising = scene.restir.use_denoising = False
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.samples = scene.restir.samples = SAMPLES
    scene.cycles.pixel_filter_type = scene.restir.pixel_filter = "BOX"
    scene.restir.reuse.pilot, scene.restir.is_initialized = False, True
    return scene


def features(scene, engine: str, folder) -> dict[str, np.ndarray]:
    """(materials, channels) of each pass of denoising data, the mean over the rows."""
    scene.render.engine, scene.render.filepath = engine, str(folder / f"{engine}.exr")
    bpy.ops.render.render(write_still=True)
    found = {}
    for name, pixels in sorted(exr.channels(scene.render.filepath).items()):
        if "Denoising" in name:
            found.setdefault(name.split(".")[1], []).append(pixels.mean(0))
    return {name: np.stack(channels, 1) for name, channels in found.items()}


@pytest.mark.parametrize("integrator", ["PATH", "RESTIR"])
def test_as_cycles(scene, tmp_path, integrator):
    """By either version's rule, in whose roughness and mirror-like albedo there is no chance."""
    scene.restir.integrator = integrator
    theirs, ours = (features(scene, engine, tmp_path) for engine in ("CYCLES", "RESTIR"))
    assert set(theirs) == set(ours)
    assert ("Denoising Roughness" in ours) == (bpy.app.version >= (5, 2, 0))
    bounds = {"Denoising Depth": 0.25, "Denoising Specular Albedo": 2e-3}
    for name, expected in theirs.items():
        assert np.abs(ours[name] - expected).max() < bounds.get(name, 0.025), name


def test_the_picture_before_it_is_denoised(scene, tmp_path):
    scene.restir.use_denoising, scene.restir.integrator = True, "PATH"
    scene.render.engine, scene.render.filepath = "RESTIR", str(tmp_path / "denoised.exr")
    bpy.ops.render.render(write_still=True)
    found = exr.channels(scene.render.filepath)
    scene.restir.use_denoising = False
    bpy.ops.render.render(write_still=True)
    plain = exr.channels(scene.render.filepath)
    for channel in "RGBA":
        np.testing.assert_array_equal(found[f"ViewLayer.Noisy Image.{channel}"], plain[f"ViewLayer.Combined.{channel}"])
    assert not any("Noisy" in name for name in plain)
