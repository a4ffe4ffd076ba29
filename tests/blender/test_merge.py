"""Files of ranges of the samples, merged: the picture of one render, whichever way it is delivered."""

import shutil

import bpy
import numpy as np
import OpenEXR
import pytest

from restir_engine.farm.exr import FileError, Key, MultilayerFile
from restir_engine.farm.merge import main, merge
from restir_engine.farm.record import read_records
from testing.blender import ranges
from testing.blender.render import quiet, read

# Sums of float32 in another order, and each pass divided and multiplied by what it is divided by: measured 3e-6.
ROUNDING = 1e-5


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """The scene, the file of one render, and those of three ranges."""
    folder = tmp_path_factory.mktemp("ranges")
    scene = ranges.build()
    return scene, ranges.save(scene, folder / "whole.exr"), ranges.save_ranges(scene, folder, 3)


def worst(one, other) -> tuple[float, str, str]:
    """The greatest difference of any pass, and where it is."""
    return max((difference, layer, name) for layer, name, difference in ranges.differences(one, other))


def test_merged_ranges_are_one_render_in_every_pass(rendered, tmp_path):
    """Told by it: light passes that are not weighted by their colour, ids added by rank, Position of the last range."""
    _, whole, parts = rendered
    assert merge(parts, tmp_path / "merged.exr", finish=True) == []
    found = worst(tmp_path / "merged.exr", whole)
    assert found[0] < ROUNDING, found
    one, all_of = (MultilayerFile(path) for path in (whole, tmp_path / "merged.exr"))
    record = all_of.records["All"]
    assert (record.samples, record.ranges, record.of, record.finished) == (24, ((0, 24),), 24, True)
    times = [MultilayerFile(path).records["All"].render_time for path in parts]
    assert record.render_time == pytest.approx(sum(times))
    assert {k: v for k, v in one.fields.items() if k.startswith("crypto")}.items() <= all_of.fields.items()


def test_a_merged_file_is_rendered_as_one_render_is(rendered, tmp_path):
    """What merging needs is not among its passes; the same of what Blender makes of it, in 8 bits."""
    scene, whole, parts = rendered
    merge(parts, tmp_path / "merged.exr")
    carried = Key("Few", "", "Bare Catcher")
    assert carried in MultilayerFile(tmp_path / "merged.exr").keys and carried not in MultilayerFile(whole).keys
    # Ranges that were set before do not matter to it.
    film = {"film_from": str(tmp_path / "merged.exr"), "sample_offset": 8}
    ranges.save(scene, tmp_path / "delivered.exr", **film)
    found = worst(tmp_path / "delivered.exr", whole)
    assert found[0] < ROUNDING, found
    ours, theirs = (MultilayerFile(path, header_only=True).fields for path in (tmp_path / "delivered.exr", whole))
    assert ours.keys() == theirs.keys()
    assert [k for k in ours if ours[k] != theirs[k] and k not in ("Date", "RenderTime")] == [
        k for k in ours if k.endswith(".render_time")
    ]
    pictures = [png(scene, tmp_path / f"{name}.png", **own) for name, own in (("one", {}), ("film", film))]
    assert np.abs(pictures[0] - pictures[1]).max() < 1.5 / 255.0 and pictures[0].std() > 0.1


def png(scene, path, **own) -> np.ndarray:
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_depth = "PNG", "8"
    for name, value in own.items():
        setattr(scene.restir, name, value)
    scene.render.filepath = str(path)
    with quiet():
        bpy.ops.render.render(write_still=True)
    for name in own:
        scene.restir.property_unset(name)
    return read(str(path))


def test_a_picture_is_denoised_once_where_it_was_asked_for(rendered, tmp_path):
    """A range is not; it has what the denoiser needs, also where nobody asked for that."""
    scene, whole, _ = rendered
    ranges.save(scene, tmp_path / "whole.exr", use_denoising=True)
    parts = ranges.save_ranges(scene, tmp_path, 3, use_denoising=True)
    merge(parts, tmp_path / "merged.exr")
    noisy, plain = (MultilayerFile(path).pixels(Key("Few", "", "Combined"), "RGB")
                    for path in (tmp_path / "merged.exr", whole))  # fmt: skip
    np.testing.assert_allclose(noisy, plain, rtol=1e-4, atol=1e-5)
    ranges.save(scene, tmp_path / "film.exr", film_from=str(tmp_path / "merged.exr"), use_denoising=True)
    merge([tmp_path / "merged.exr"], tmp_path / "finished.exr", finish=True)
    for name in ("film.exr", "finished.exr"):
        found = worst(tmp_path / name, tmp_path / "whole.exr")
        assert found[0] < 2e-3, (name, found)  # of Open Image Denoise, which does not round alike


def test_pixels_count_by_their_samples(rendered, tmp_path):
    """With a noise threshold: the mean of the parts by their own counts, which are carried along.

    Told by it: parts that count by the samples of those pixels that have most.
    """
    scene, _, _ = rendered
    own = {"use_adaptive_sampling": True, "adaptive_threshold": 0.5, "adaptive_min_samples": 8, "samples": 96}
    before = scene.restir.samples
    scene.restir.samples = 96
    parts = ranges.save_ranges(scene, tmp_path, 2, **own)
    scene.restir.samples = before
    merge(parts, tmp_path / "merged.exr")
    files = [MultilayerFile(path) for path in (*parts, tmp_path / "merged.exr")]
    one, other, total = (file.pixels(Key("Few", "", "Debug Sample Count"), "X") for file in files)
    assert (one + other == total).all() and (one != other).any() and one.min() < one.max()
    colors = [file.pixels(Key("Few", "", "Combined"), "RGB") for file in files]
    np.testing.assert_allclose(colors[2], (one * colors[0] + other * colors[1]) / total, rtol=1e-5, atol=1e-6)


def test_merging_has_no_order_and_can_go_on(rendered, tmp_path):
    _, whole, parts = rendered
    merge(parts[:2], tmp_path / "some.exr")
    assert read_records(MultilayerFile(tmp_path / "some.exr").fields)["All"].ranges == ((8, 24),)
    assert main(["-o", str(tmp_path / "all.exr"), "--finish", str(tmp_path / "some.exr"), str(parts[2])]) == 0
    assert worst(tmp_path / "all.exr", whole)[0] < ROUNDING


def test_view_layers_with_samples_of_their_own_have_them_in_the_merged_file(rendered, tmp_path):
    """Two samples in three ranges: the first has none, and the Position of the second counts."""
    scene = rendered[0]
    few = scene.view_layers["Few"]
    few.samples = 2
    try:
        ranges.save(scene, tmp_path / "whole.exr")
        parts = ranges.save_ranges(scene, tmp_path, 3)
    finally:
        few.samples = 0
    assert [MultilayerFile(path).records["Few"].samples for path in parts] == [1, 1, 0]
    assert merge(parts, tmp_path / "merged.exr", finish=True) == []
    found = worst(tmp_path / "merged.exr", tmp_path / "whole.exr")
    assert found[0] < ROUNDING, found


def test_a_gap_is_a_warning_an_overlap_an_error(rendered, tmp_path, capsys):
    _, _, parts = rendered
    (line, other) = merge(parts[::2], tmp_path / "gap.exr")
    assert line == "Samples 8 to 16 of 24 (view layer “All”) are in none of “part_16.exr”, “part_0.exr”"
    assert "Few" in other
    shutil.copy(parts[0], tmp_path / "again.exr")
    (tmp_path / "out").mkdir()
    assert main(["-o", str(tmp_path / "out" / "m.exr"), *map(str, parts), str(tmp_path / "again.exr")]) == 1
    told = capsys.readouterr().err
    assert "part_16.exr” and “" in told and "again.exr” both have samples 16 to 24 of view layer “All”" in told
    assert list((tmp_path / "out").iterdir()) == []


UNLIKE = ("seeds (0 and 5)", "render settings", "exposures", "sizes (32 × 24 and 16 × 24)", "cameras", "passes")


@pytest.mark.parametrize("words", UNLIKE)
def test_files_that_are_not_of_one_picture_are_named(rendered, tmp_path, words):
    scene, _, parts = rendered
    other, own = tmp_path / "other.exr", {"sample_offset": 16, "sample_subset": 8}
    owner, name, value = {
        "seeds": (scene.restir, "seed", 5),
        "render": (scene.restir, "max_bounces", 2),
        "exposures": (scene.restir, "film_exposure", 2.0),
        "sizes": (scene.render, "resolution_x", 16),
        "cameras": (scene.camera, "location", (0.01, -7.0, 3.0)),
        "passes": (scene.view_layers[0], "use_pass_mist", False),
    }[words.split()[0]]
    before = getattr(owner, name)
    before = before.copy() if name == "location" else before
    setattr(owner, name, value)
    try:
        ranges.save(scene, other, **own)
    finally:
        setattr(owner, name, before)
    with pytest.raises(FileError) as error:
        merge([parts[2], other], tmp_path / "merged.exr")
    text = f"“{parts[2]}” and “{other}” are not of one picture: they have different {words}"
    assert str(error.value).startswith(text)
    assert not (tmp_path / "merged.exr").exists()


def test_what_cannot_be_written_leaves_nothing(rendered, tmp_path, monkeypatch):
    parts = rendered[2]
    monkeypatch.setattr("pathlib.Path.replace", lambda self, target: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(FileError, match="” cannot be written: disk full"):
        merge(parts, tmp_path / "merged.exr")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(FileError, match="” is not there"):
        merge([tmp_path / "nowhere.exr"], tmp_path / "merged.exr")


def test_a_film_that_does_not_serve_is_a_sentence(rendered, tmp_path):
    scene, whole, _ = rendered
    for path, width, text in (
        (tmp_path / "no.exr", 32, "” is not there"),
        (whole, 30, "has 32 × 24 pixels, the picture 30 × 24"),
    ):
        scene.render.resolution_x = width
        with pytest.raises(RuntimeError, match=text):
            ranges.save(scene, tmp_path / "film.exr", film_from=str(path))
    scene.render.resolution_x = 32
    scene.restir.film_from = ""


def test_a_render_region_is_merged_and_the_rest_of_the_frame_left_alone(rendered, tmp_path):
    """Told by it: merging all of the frame, which leaves 0 in Vector where Blender has 10000."""
    scene = rendered[0]
    render = scene.render
    render.use_border, render.border_min_x, render.border_max_x = True, 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.0, 0.5
    try:
        whole = ranges.save(scene, tmp_path / "whole.exr")
        merge(ranges.save_ranges(scene, tmp_path, 3), tmp_path / "merged.exr")
        ranges.save(scene, tmp_path / "film.exr", film_from=str(tmp_path / "merged.exr"))
    finally:
        render.use_border = False
    merge([tmp_path / "merged.exr"], tmp_path / "finished.exr", finish=True)
    assert MultilayerFile(whole).size == (16, 12)
    for name in ("film.exr", "finished.exr"):
        assert worst(tmp_path / name, whole)[0] < ROUNDING, name
        own, others = (frame(path, "Few.Combined.A", "Few.Vector.X") for path in (tmp_path / name, whole))
        np.testing.assert_allclose(own, others, rtol=1e-5, atol=1e-5)


def test_views_are_merged_each_by_itself(rendered, tmp_path):
    scene = rendered[0]
    render, image = scene.render, scene.render.image_settings
    ranges.save(scene, tmp_path / "one_view.exr")  # after which files can have several
    before, render.use_multiview, image.views_format = image.views_format, True, "MULTIVIEW"
    try:
        whole = ranges.save(scene, tmp_path / "whole.exr")
        merge(ranges.save_ranges(scene, tmp_path, 3), tmp_path / "merged.exr", finish=True)
        ranges.save(scene, tmp_path / "film.exr", film_from=str(tmp_path / "merged.exr"))
        with pytest.raises(RuntimeError, match="has no view “left”: save all views of its ranges in one file"):
            ranges.save(scene, tmp_path / "no.exr", film_from=str(tmp_path / "one_view.exr"))
    finally:
        render.use_multiview, image.views_format = False, before
        scene.restir.film_from = ""
    assert {key.view for key in MultilayerFile(tmp_path / "merged.exr").keys} == {"left", "right"}
    for name in ("merged.exr", "film.exr"):
        found = worst(tmp_path / name, whole)
        assert found[0] < ROUNDING, (name, found)


def frame(path, *channels: str) -> np.ndarray:
    """Channels of all pixels that a file has."""
    found = OpenEXR.File(str(path), separate_channels=True)
    every = {name: channel.pixels for part in found.parts for name, channel in part.channels.items()}
    return np.stack([every[name] for name in channels])
