"""Image files against Cycles: every depth and kind of alpha, in each alpha mode, with and without the Alpha output."""

import itertools

import bpy
import numpy as np
import pytest

from testing.blender import exr_files, image_files
from testing.blender.nodes import add_node, compare

HALF = 3e-3  # Cycles keeps converted colours in half precision

COLORS = ((0.8, 0.5, 0.2, 0.6), (0.8, 0.5, 0.2, 0.02), (0.8, 0.5, 0.2), (0.5,), (0.5, 0.3))
MODES = ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")
KINDS = [("png", 8), ("png", 16), ("tif", 8), ("tif", 16), ("tif", 32), ("associated tif", 16), ("associated tif", 32)]


def texture(path, space, mode, with_alpha, packed):
    """Red and green of an image file, and blue, or alpha in place of it."""

    def build(tree):
        picture = bpy.data.images.load(str(path), check_existing=False)
        picture.colorspace_settings.name, picture.alpha_mode = space, mode
        if packed:
            picture.pack()
        node = add_node(tree, "ShaderNodeTexImage", image=picture, extension="EXTEND")
        if not with_alpha:
            return node.outputs["Color"]
        split = add_node(tree, "ShaderNodeSeparateXYZ", inputs={"Vector": node.outputs["Color"]})
        inputs = {"X": split.outputs[0], "Y": split.outputs[1], "Z": node.outputs["Alpha"]}
        return add_node(tree, "ShaderNodeCombineXYZ", inputs=inputs).outputs[0]

    return build


def written(folder, kind, bits, color):
    path = folder / f"{kind} {bits} {color}.{kind[-3:]}"
    if kind == "png":
        image_files.write_png(path, color, bits)
    else:
        image_files.write_tiff(path, color, bits, associated=kind != "tif")
    return path


def wrong(cases):
    """The cases whose middle differs: (Cycles, ours)."""
    found = {}
    for name, parity in compare(cases).items():
        if not parity.error <= HALF:
            found[name] = parity.cycles[4, 4], parity.ours[4, 4]
    return found


@pytest.mark.parametrize("packed", [False, True], ids=["file", "packed"])
@pytest.mark.parametrize("space", ["sRGB", "Non-Color", "Linear Rec.709", "Rec.1886"])
def test_alpha_of_files(space, packed, tmp_path):
    cases = {}
    for (kind, bits), color in itertools.product(KINDS, COLORS):
        path = written(tmp_path, kind, bits, color)
        has_alpha = len(color) in (2, 4)
        for mode in MODES if has_alpha else MODES[:1]:
            for with_alpha in (False, True) if has_alpha else (False,):
                name = f"{path.name} {mode}" + (" with alpha" if with_alpha else "")
                cases[name] = texture(path, space, mode, with_alpha, packed)
    assert wrong(cases) == {}


def test_a_sequence_of_files_with_16_bits(tmp_path):
    for number, alpha in enumerate((0.3, 0.6), 1):
        image_files.write_png(tmp_path / f"shot_{number:02d}.png", (0.8, 0.5, 0.2, alpha), 16)

    def shot(mode, with_alpha):
        def build(tree):
            output = texture(tmp_path / "shot_01.png", "sRGB", mode, with_alpha, False)(tree)
            node = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeTexImage")
            node.image.source = "SEQUENCE"
            node.image_user.frame_duration, node.image_user.frame_offset = 2, 1
            node.image_user.use_auto_refresh = True
            return output

        return build

    cases = {f"{mode} {alpha}": shot(mode, alpha) for mode in MODES for alpha in (False, True)}
    assert wrong(cases) == {}


def _movie(path, colors):
    """Write a movie without losses, of one colour a frame, by the sequencer of a scene of its own."""
    scene = bpy.data.scenes.new("movie")
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    for frame, color in enumerate(colors, 1):
        length = {"length": 1} if bpy.app.version >= (5, 0, 0) else {"frame_end": frame + 1}
        strips.new_effect(name="color", type="COLOR", channel=1, frame_start=frame, **length).color = color
    scene.frame_start, scene.frame_end = 1, len(colors)
    render = scene.render
    render.resolution_x = render.resolution_y = 32
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "VIDEO"
    render.image_settings.file_format, render.filepath = "FFMPEG", str(path)
    render.ffmpeg.format, render.ffmpeg.codec = "AVI", "FFV1"
    scene.view_settings.view_transform = "Standard"
    bpy.ops.render.render(animation=True, scene=scene.name)
    bpy.data.scenes.remove(scene)


def test_frames_of_a_movie(tmp_path):
    _movie(tmp_path / "movie.avi", [(k / 5.0, 0.5, 1.0 - k / 5.0) for k in range(5)])

    def shown(**user):
        def build(tree):
            picture = bpy.data.images.load(str(tmp_path / "movie.avi"), check_existing=False)
            node = add_node(tree, "ShaderNodeTexImage", image=picture)
            for name, value in user.items():
                setattr(node.image_user, name, value)
            bpy.context.scene.frame_current = 7
            return node.outputs["Color"]

        return build

    cases = {
        "last": shown(frame_duration=5),
        "third": shown(frame_duration=5, frame_start=5),
        "cyclic": shown(frame_duration=5, use_cyclic=True),
        "no duration": shown(frame_duration=0, frame_offset=2),
    }
    assert wrong(cases) == {}


def test_what_headers_say(tmp_path):
    from restir_engine.sync.image_headers import file_alpha

    image_files.write_png(tmp_path / "grey.png", (0.5, 0.3), 16)
    image_files.write_tiff(tmp_path / "colour.tif", (0.5, 0.3, 0.2, 0.1), 16, associated=True)
    assert file_alpha(str(tmp_path / "grey.png")) == (True, False)
    assert file_alpha(str(tmp_path / "colour.tif")) == (False, True)
    (tmp_path / "empty.png").write_bytes(b"")
    assert file_alpha(str(tmp_path / "empty.png")) == (False, False)


def _exr(*names, kind=exr_files.SCAN, levels=exr_files.ONE, part="part"):
    """A part whose channels differ, each by a gradient."""
    shades = {name: 0.9 - 0.07 * "RGBAXYZUV".index(name[-1]) for name in names}
    gradient = np.linspace(0.5, 1.0, 20)
    return exr_files.Part(
        {name: np.tile(shade * gradient, (20, 1)) for name, shade in shades.items()}, kind, levels, part
    )


TILED, DEEP = {"kind": exr_files.TILED}, {"kind": exr_files.DEEP_SCAN}
EXR_FILES = {
    "tiles": [_exr(*"RGBA", **TILED)],
    "mipmap": [_exr(*"RGB", **TILED, levels=exr_files.MIPMAP)],
    "ripmap": [_exr(*"RGBA", **TILED, levels=exr_files.RIPMAP)],
    "layers in tiles": [_exr("a.R", "a.G", "a.B", "b.A", **TILED, levels=exr_files.MIPMAP)],
    "parts of tiles": [_exr(*"RGBA", **TILED, levels=exr_files.RIPMAP), _exr(*"Z", **TILED, part="other")],
    "tiles and lines": [_exr(*"RGBA", **TILED), _exr(*"Z", part="other")],
    "lines and tiles": [_exr(*"RGBA"), _exr(*"Z", **TILED, part="other")],
    "depth first": [_exr(*"Z"), _exr(*"RGBA", part="other")],
    "layer without colours": [_exr("a.Z", "b.R", "b.G", "b.B")],
    "names of all kinds": [_exr(*"UVZ")],
    "red and green": [_exr(*"RG")],  # packed, Blender's blue is what was in memory
    "red and alpha and depth": [_exr(*"RAZ")],
    "depth for alpha": [_exr(*"RGBZ")],
    "position": [_exr(*"XYZ")],
    "grey and alpha": [_exr(*"YA")],
    "U and V": [_exr(*"UV")],
    "deep": [_exr(*"RGBA", **DEEP)],
    "deep tiles": [_exr(*"RGBA", kind=exr_files.DEEP_TILED)],
    "deep first": [_exr(*"RGBA", **DEEP), _exr(*"RGBA", part="other")],
    "deep second": [_exr(*"RGBA"), _exr(*"RGBA", **DEEP, part="other")],
}


@pytest.mark.parametrize("packed", [False, True], ids=["file", "packed"])
def test_every_kind_of_exr(packed, tmp_path, caplog):
    caplog.set_level("WARNING", logger="restir_engine.scene.warnings")  # which the command that merges silences
    cases = {}
    for name, parts in EXR_FILES.items():
        if packed and name == "red and green":
            continue
        exr_files.write(tmp_path / f"{name}.exr", *parts)
        for mode, with_alpha in (("PREMUL", False), ("PREMUL", True), ("STRAIGHT", True)):
            cases[f"{name} {mode} {with_alpha}"] = texture(
                tmp_path / f"{name}.exr", "Linear Rec.709", mode, with_alpha, packed
            )
    found = wrong(cases)
    if bpy.app.version < (5, 0, 0):  # Cycles shows what happens to be in memory
        found = {name: values for name, values in found.items() if "deep" not in name}
    assert found == {}
    deep = [record.getMessage() for record in caplog.records if "is a deep" in record.getMessage()]
    assert len(deep) == len([name for name in cases if "deep" in name and (packed or "second" not in name)])


@pytest.mark.parametrize("packed", [False, True], ids=["file", "packed"])
def test_the_first_layer_of_a_multilayer_file(packed, tmp_path, scene):
    scene.render.resolution_x, scene.render.resolution_y = 40, 40
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 1
    scene.cycles.use_denoising = False
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    coordinates = world.node_tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]
    background = next(node for node in world.node_tree.nodes if node.bl_idname == "ShaderNodeBackground")
    world.node_tree.links.new(coordinates, background.inputs["Color"])
    scene.world = world
    bpy.context.view_layer.use_pass_normal = bpy.context.view_layer.use_pass_z = True
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    paths = []
    for codec, interleave in itertools.product(("NONE", "ZIP", "ZIPS", "PIZ", "RLE", "DWAA"), (False, True)):
        settings.exr_codec = codec
        if hasattr(settings, "use_exr_interleave"):
            settings.use_exr_interleave = interleave
        elif interleave:
            continue
        if codec == "DWAA" and (interleave or not hasattr(settings, "use_exr_interleave")):
            continue  # its channels cannot be told from their packing
        paths.append(tmp_path / f"{codec} {interleave}.exr")
        scene.render.filepath = str(paths[-1])
        bpy.ops.render.render(write_still=True)

    def case(path):
        def build(tree):
            node = add_node(tree, "ShaderNodeTexImage", image=bpy.data.images.load(str(path)), interpolation="Closest")
            if packed:
                node.image.pack()
            return node.outputs["Color"]

        return build

    results = compare({path.name: case(path) for path in paths})
    for name, parity in results.items():
        assert np.ptp(parity.cycles) > 0.05, name
        assert np.quantile(np.abs(parity.cycles - parity.ours), 0.95) < HALF, name
