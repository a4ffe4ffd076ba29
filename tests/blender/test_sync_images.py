"""Images of a file as the scene keeps them; the artist's datablocks stay as they are."""

import bpy
import numpy as np
import pytest

from restir_engine.scene.description import SceneDescription
from restir_engine.scene.images import ImageTable
from restir_engine.sync.images import image_index, tile_indices


@pytest.fixture(autouse=True)
def empty_file():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def picture(name="picture", is_float=False, values=(0.2, 0.4, 0.6, 1.0)):
    image = bpy.data.images.new(name, 4, 2, alpha=True, float_buffer=is_float)
    image.pixels.foreach_set(np.tile(np.array(values, np.float32), 8))
    return image


def user():
    material = bpy.data.materials.new("user")
    material.use_nodes = True
    return material.node_tree.nodes.new("ShaderNodeTexImage").image_user


def test_bytes_stay_bytes_and_are_kept_once():
    scene, image = SceneDescription(), picture()
    first = image_index(scene, image, user(), pytest.fail)
    assert image_index(scene, image, user(), pytest.fail) == first == 0
    assert len(scene.images) == 1 and scene.images.nbytes == 4 * 2 * 4
    record = scene.images.records()[0]
    assert (record["width"], record["height"]) == (4, 2) and record["decode"] != 0


def test_floats_stay_floats():
    scene = SceneDescription()
    image_index(scene, picture(is_float=True, values=(5.0, 0.4, 0.6, 1.0)), user(), pytest.fail)
    assert scene.images.nbytes == 4 * 2 * 4 * 4 and scene.images.records()[0]["decode"] == 0


def test_pixels_that_are_not_numbers_are_black():
    scene, image = SceneDescription(), picture(is_float=True)
    values = np.full((8, 4), 0.5, np.float32)
    values[1, 2], values[2, 0] = np.nan, np.inf
    image.pixels.foreach_set(values.ravel())
    image_index(scene, image, user(), pytest.fail)
    kept = scene.images.pixels(0).reshape(8, 4)
    assert np.isfinite(kept).all() and not kept[1].any() and not kept[2].any() and kept[3].all()


def test_images_of_another_table_are_taken_over_unless_they_have_changed():
    scene, same, changed = SceneDescription(), picture(), picture("changed")
    for image in (same, changed):
        image_index(scene, image, user(), pytest.fail)
    again = SceneDescription()
    again.images = ImageTable(scene.images)
    again.images.drop((changed.session_uid, 0, 0))
    changed.scale(8, 8)
    there = [image_index(again, image, user(), pytest.fail) for image in (changed, same)]
    assert there == [0, 1]
    assert again.images.pixels(0).shape[1] == 8
    assert again.images.pixels(1) is scene.images.pixels(0)


def test_memory_that_blender_did_not_use_is_given_back(tmp_path):
    image = picture()
    image.filepath_raw, image.file_format = str(tmp_path / "file.png"), "PNG"
    image.save()
    loaded = bpy.data.images.load(str(tmp_path / "file.png"))
    loaded.buffers_free()
    image_index(SceneDescription(), loaded, user(), pytest.fail)
    assert not loaded.has_data
    assert loaded.pixels[0] == pytest.approx(0.2, abs=1e-6)  # loaded now, and so it stays
    image_index(SceneDescription(), loaded, user(), pytest.fail)
    assert loaded.has_data


@pytest.mark.parametrize("space", ["sRGB", "Rec.1886", "Non-Color"])
def test_nothing_is_left_behind(space, tmp_path):
    image = picture()
    image.filepath_raw, image.file_format = str(tmp_path / "file.png"), "PNG"
    image.save()
    loaded = bpy.data.images.load(str(tmp_path / "file.png"))
    loaded.colorspace_settings.name = space
    loaded.alpha_mode = "PREMUL"
    names = [item.name for item in bpy.data.images]
    scene = SceneDescription()
    assert image_index(scene, loaded, user(), pytest.fail) == 0
    assert [item.name for item in bpy.data.images] == names
    assert (loaded.colorspace_settings.name, loaded.alpha_mode) == (space, "PREMUL")


def test_missing_files_warn_and_are_magenta():
    said = []
    lost = bpy.data.images.new("lost", 4, 4)
    lost.source = "FILE"
    lost.filepath = "/nowhere/lost.png"
    lost.reload()
    assert image_index(SceneDescription(), lost, user(), said.append) == -1
    assert len(said) == 1 and "lost" in said[0]


def test_a_missing_frame_is_named():
    said = []
    sequence = bpy.data.images.new("shot", 4, 4)
    sequence.source = "SEQUENCE"
    sequence.filepath = "/nowhere/shot_0001.png"
    scene = SceneDescription()
    scene.frame = 12
    frames = user()
    frames.frame_duration, frames.frame_start = 100, 1
    assert image_index(scene, sequence, frames, said.append) == -1
    assert "frame 12" in said[0]


def test_missing_tiles_are_missing_alone(tmp_path):
    image = picture()
    image.filepath_raw, image.file_format = str(tmp_path / "tile.1001.png"), "PNG"
    image.save()
    tiled = bpy.data.images.load(str(tmp_path / "tile.1001.png"))
    tiled.source = "TILED"
    tiled.filepath = str(tmp_path / "tile.<UDIM>.png")
    tiled.tiles.new(1002)
    said = []
    assert tile_indices(SceneDescription(), tiled, said.append) == {1001: 0, 1002: -1}
    assert "tile 1002" in said[0]
