"""What the denoiser should be given of light below a textured surface: `python -m benchmarks.demodulation`.

A head-like body of textured skin with HYBRID, denoised as it is or with the subsurface light divided before, and
multiplied after, by the scattering albedo α or by the colour A of the medium. The rest of the light is denoised on its
own then. Against the mean of two renders of many samples: relMSE, as the product of the differences from both, so that
their noise is not in it, and FLIP; that of no denoising beside them.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import bpy
import numpy as np

from restir_engine import properties
from restir_engine.denoise import filter_image
from restir_engine.kernels.subsurface.van_de_hulst import scattering_albedo
from restir_engine.session import Session
from restir_engine.sync.depsgraph import build_scene
from testing.blender import kit, render
from testing.blender.registry import Scene
from testing.measures import flip, srgb

from .scatter_bodies import head

PASSES = ("Combined", "Subsurface", "Denoising Albedo", "Denoising Normal")
DARKEST = 1e-3  # what light is divided by at least
LENGTHS = (0.01, 0.05)  # mean free paths of the reddest channel; the head is about one unit high


def _skin(node):
    """Blotches, freckles and make-up, as a photograph of a face has them."""
    blotches = node("TexNoise", Scale=6.0, Detail=3.0)
    freckles = node("TexVoronoi", Scale=28.0)
    wave = node("TexWave", Scale=3.0, Distortion=6.0)
    tones = kit.ramp(node, blotches, [(0.35, (0.75, 0.42, 0.3)), (0.6, (0.9, 0.68, 0.55))])
    spots = kit.ramp(node, freckles.outputs["Distance"], [(0.12, (0.25, 0.11, 0.06)), (0.2, (1, 1, 1))])
    paint = kit.ramp(node, wave, [(0.86, (1, 1, 1)), (0.9, (0.15, 0.2, 0.6))])
    color = node("MixRGB", Fac=1.0, Color1=tones, Color2=spots, blend_type="MULTIPLY")
    return node("MixRGB", Fac=1.0, Color1=color, Color2=paint, blend_type="MULTIPLY")


def _face(length: float):
    """Builds the scene: Principled, whose Subsurface Radius is a mean free path in every Blender by our own medium."""

    def build() -> None:
        body = head()
        mesh = bpy.data.meshes.new("Head")
        mesh.from_pydata(np.asarray(body.vertices).tolist(), [], np.asarray(body.triangles).tolist())
        mesh.shade_smooth()
        material = kit.material(
            lambda node: node("BsdfPrincipled", Base_Color=_skin(node), Subsurface_Weight=1.0, Roughness=0.4)
        )
        own = material.restir
        own.use_medium, own.use_color = True, False
        own.mean_free_path, own.scale = (1.0, 0.4, 0.25), length
        mesh.materials.append(material)
        kit.add(mesh)
        kit.camera((0.4, -3.0, 0.3), (0.0, 0.0, 0.0))
        bpy.context.scene.camera.data.lens = 105.0
        kit.lamp(60)
        kit.world(lambda node: node("Background", Strength=0.3))

    return build


def passes(samples: int, seed: int) -> dict[str, np.ndarray]:
    """The passes of the current scene, rgb."""
    scene = bpy.context.scene
    scene.restir.samples, scene.restir.seed = samples, seed
    depsgraph = bpy.context.evaluated_depsgraph_get()
    settings = properties.render_settings(scene, bpy.context.view_layer)
    settings = settings.__class__(**vars(settings) | {"passes": frozenset(PASSES)})
    session = Session(build_scene(depsgraph, settings), settings)
    session.render()
    return {name: session.film.pass_array(name)[..., :3] for name in PASSES}


def denoised(found: dict[str, np.ndarray], divisor: np.ndarray | None) -> np.ndarray:
    """The picture; with a divisor, light below the surface is divided by it and denoised apart."""
    light, albedo, normal = found["Combined"], found["Denoising Albedo"], found["Denoising Normal"]
    if divisor is None:
        return filter_image(light, albedo, normal)
    below, divisor = found["Subsurface"], np.maximum(divisor, DARKEST)
    rest = filter_image(light - below, albedo, normal)
    return rest + divisor * filter_image(below / divisor, albedo / divisor, normal)


def error(image: np.ndarray, truths: list[np.ndarray]) -> float:
    """relMSE without what the truths' own noise adds."""
    one, other = truths
    return float(((image - one) * (image - other) / ((0.5 * (one + other)) ** 2 + 0.01)).mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--reference", type=int, default=512, help="samples of each of two truths")
    parser.add_argument("--method", default="HYBRID")
    parser.add_argument("--out", type=Path, help="folder for pictures")
    asked = parser.parse_args()
    render.register()
    forms = ("noisy", "as it is", "by α", "by A")
    print("| mfp | samples | " + " | ".join(f"{form}: relMSE | FLIP" for form in forms) + " |")
    print("|" + "---|" * (2 + 2 * len(forms)))
    for length in LENGTHS:
        settings = {"sss_method": asked.method, "max_bounces": 4, "diffuse_bounces": 2}
        render.prepare(Scene(f"head {length}", _face(length), 0, 1, (128, 128), settings))
        with render.quiet():
            truths = [passes(asked.reference, seed)["Combined"] for seed in (8, 9)]
        truth = np.mean(truths, axis=0)
        for samples in (4, 16, 64):
            with render.quiet():
                found = passes(samples, 1)
            color = found["Denoising Albedo"]
            divisors = {
                "as it is": None,
                "by α": np.vectorize(scattering_albedo)(np.clip(color, 0.0, 1.0)),
                "by A": color,
            }
            images = {"noisy": found["Combined"]} | {form: denoised(found, by) for form, by in divisors.items()}
            cells = [f"{error(images[form], truths):.5f} | {flip(images[form], truth):.4f}" for form in forms]
            print(f"| {length:g} | {samples} | " + " | ".join(cells) + " |", flush=True)
            if asked.out:
                strip = np.concatenate([srgb(image) for image in (*images.values(), truth)], 1)
                render.save(asked.out / f"head-{length:g}-{samples}.png", strip)
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
