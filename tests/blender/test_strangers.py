"""Files that strangers made: each opens, renders to something sensible, and leaves no NaN.

They need RESTIR_ASSETS, a folder with a subfolder `blend`. `python -m tests.blender.test_strangers OUT` writes a
picture of each, Cycles above ReSTIR.
"""

import math
import os
import sys
from pathlib import Path

import bpy
import mathutils
import numpy as np
import pytest

from restir_engine import engine

ASSETS = os.environ.get("RESTIR_ASSETS", "")
FILES = sorted((Path(ASSETS) / "blend").glob("*.blend")) if ASSETS else []


def open_file(path: Path) -> bpy.types.Scene:
    """Load a file and give it what a picture needs: a camera that sees everything, and light."""
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path))
    except RuntimeError:  # raised for files from the future although they have been loaded
        assert bpy.data.filepath
    scene = bpy.context.scene
    if scene.camera is None:
        add_camera(scene)
    has_light = any(o.type == "LIGHT" for o in scene.objects)
    if not has_light:
        scene.world = bpy.data.worlds.new("Sky")
        scene.world.color = (0.8, 0.8, 0.8)
        if bpy.app.version < (5, 0, 0):
            scene.world.use_nodes = True
        scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.8, 0.8, 0.8, 1.0)
    scene.use_nodes = False
    scene.render.use_border = scene.render.use_crop_to_border = False
    scene.render.use_sequencer = False
    scene.render.resolution_percentage = 100
    return scene


def add_camera(scene: bpy.types.Scene) -> None:
    """A camera that looks at all meshes from the front, a little from above."""
    corners = [o.matrix_world @ mathutils.Vector(c) for o in scene.objects if o.type == "MESH" for c in o.bound_box]
    corners = np.array(corners or [(-1, -1, -1), (1, 1, 1)])
    center, radius = corners.mean(0), np.linalg.norm(np.ptp(corners, axis=0)) / 2
    data = bpy.data.cameras.new("Camera")
    camera = bpy.data.objects.new("Camera", data)
    direction = mathutils.Vector((0.4, -1.0, 0.5)).normalized()
    camera.location = mathutils.Vector(center) + direction * radius / math.sin(data.angle / 2) * 0.9
    camera.rotation_euler = direction.to_track_quat("Z", "Y").to_euler()
    data.clip_end = 10 * radius / math.sin(data.angle / 2) + 1000.0
    scene.collection.objects.link(camera)
    scene.camera = camera


def picture(scene: bpy.types.Scene, folder: Path, name: str, size: tuple[int, int], samples: int) -> np.ndarray:
    """Render; scene-linear (height, width, 3)."""
    scene.render.engine = name
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.cycles.samples = scene.restir.samples = samples
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = scene.restir.use_denoising = False
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    scene.render.filepath = str(folder / f"{name}.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(size[1], size[0], -1)[:, :, :3]


@pytest.mark.skipif(not FILES, reason="RESTIR_ASSETS is not set")
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_strangers_file_renders(path, scene, tmp_path):
    pixels = picture(open_file(path), tmp_path, "RESTIR", (48, 32), 4)
    assert np.isfinite(pixels).all()
    assert pixels.mean() > 0.005 and pixels.std() > 1e-3


def main(folder: Path) -> None:
    """Write FOLDER/NAME.png for every file."""
    engine.register()
    folder.mkdir(parents=True, exist_ok=True)
    for path in FILES:
        scene = open_file(path)
        size = (240, 160)
        both = np.concatenate([picture(scene, folder, name, size, 64) for name in ("RESTIR", "CYCLES")])
        image = bpy.data.images.new(path.stem, size[0], 2 * size[1])
        encoded = np.clip(both, 0.0, 1.0)
        encoded = np.where(encoded < 0.0031308, 12.92 * encoded, 1.055 * encoded ** (1 / 2.4) - 0.055)
        pixels = np.ones((*both.shape[:2], 4), np.float32)
        pixels[:, :, :3] = encoded
        image.pixels.foreach_set(pixels.ravel())
        image.filepath_raw, image.file_format = str(folder / f"{path.stem}.png"), "PNG"
        image.save()
        means = [half.mean((0, 1)).round(4).tolist() for half in np.split(both, 2)]
        print(path.stem, "ReSTIR", means[0], "Cycles", means[1], flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)
