"""Texture nodes against Cycles: the same node at the same points gives the same numbers.

Coordinates are snapped to a grid of exact binary fractions where a texture jumps between points, so that both
renderers look at the same cell.
"""

from functools import partial

import bpy
import numpy as np
import pytest

from testing.blender.nodes import add_node, compare

SMOOTH = 2e-4  # textures at the points that rays hit: Cycles' sample lies up to 0.005 pixels off the middle
SNAPPED = 5e-5  # float32 noise sums against ours at equal coordinates
HALF = 4e-3  # Cycles converts other colour spaces in half precision

NOISES = ("MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "FBM", "HETERO_TERRAIN")
DIMENSIONS = ("1D", "2D", "3D", "4D")


def snapped(tree, scale=1.0):
    """Object coordinates in steps of an eighth, in the middle of each step."""
    socket = add_node(tree, "ShaderNodeTexCoord").outputs["Object"]
    for operation, operand in (("MULTIPLY", 8.0), ("FLOOR", 0.0), ("ADD", 0.5), ("MULTIPLY", 0.125 * scale)):
        inputs = {"Vector": socket, "Vector_001": (operand,) * 3}
        socket = add_node(tree, "ShaderNodeVectorMath", operation=operation, inputs=inputs).outputs[0]
    return socket


def case(identifier, output=0, inputs=None, scale=1.0, exact=True, **settings):
    """A case of one texture node."""

    def build(tree):
        vector = snapped(tree, scale) if exact else add_node(tree, "ShaderNodeTexCoord").outputs["UV"]
        node = add_node(tree, identifier, **settings)
        sockets = {socket.identifier: socket for socket in node.inputs}
        tree.links.new(vector, sockets["Vector"])
        for name, value in (inputs or {}).items():
            sockets[name].default_value = value
        return node.outputs[output]

    return build


def check(cases, tolerance, **kwargs):
    wrong = {}
    for name, parity in compare(cases, **kwargs).items():
        if np.ptp(parity.cycles) == 0.0 and "flat" not in name:
            wrong[name] = "nothing to compare"
        if not parity.error <= tolerance:
            wrong[name] = parity.error
    assert not wrong, wrong


def test_noise():
    make = partial(case, "ShaderNodeTexNoise")
    fractal = {"Detail": 3.4, "Roughness": 0.6, "Lacunarity": 2.3, "Offset": 0.3, "Gain": 1.2, "W": 2.37, "Scale": 3.0}
    cases = {
        "fraction of an octave": make(inputs={"Detail": 2.5}),
        "no roughness": make(inputs={"Detail": 2.5, "Roughness": 0.0}),
        "fifteen octaves": make(inputs={"Detail": 15.0, "Roughness": 1.0}),
        "far away": make(inputs={"Scale": 300000.7}),
        "distorted": make(inputs={"Distortion": 0.8}),
        "colour": make("Color", inputs={"Scale": 7.0, "Detail": 0.0}),
    }
    for dimensions in DIMENSIONS:
        for kind in NOISES:
            name = f"{dimensions} {kind}" + (" flat" if dimensions == "1D" else "")
            cases[name] = make(inputs=fractal, noise_dimensions=dimensions, noise_type=kind, normalize=False)
        cases[f"{dimensions} colour distorted"] = make(
            "Color", inputs={**fractal, "Distortion": 0.3}, noise_dimensions=dimensions
        )
    check(cases, 4e-4, scale=0.1, offset=1.0)


def test_voronoi():
    make = partial(case, "ShaderNodeTexVoronoi")
    inputs = {"W": 1.37, "Scale": 3.0, "Randomness": 0.9, "Smoothness": 0.8, "Exponent": 1.5}
    fractal = {**inputs, "Detail": 2.3, "Roughness": 0.6, "Lacunarity": 2.2}
    cases = {}
    for dimensions in DIMENSIONS:
        flat = " flat" if dimensions == "1D" else ""
        for feature in ("F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS"):
            kind = {"voronoi_dimensions": dimensions, "feature": feature}
            output = "Radius" if feature == "N_SPHERE_RADIUS" else "Distance"
            cases[f"{dimensions} {feature}{flat}"] = make(output, inputs=inputs, **kind)
            if output == "Distance":
                name = f"{dimensions} {feature} fractal{flat}"
                cases[name] = make(output, inputs=fractal, normalize=True, **kind)
        for output in ("Color", "W" if dimensions == "1D" else "Position"):
            name = f"{dimensions} smooth {output}{flat}"
            cases[name] = make(output, inputs=fractal, voronoi_dimensions=dimensions, feature="SMOOTH_F1")
            cases[f"{dimensions} {output}{flat}"] = make(output, inputs=inputs, voronoi_dimensions=dimensions)
    for metric in ("MANHATTAN", "CHEBYCHEV", "MINKOWSKI"):
        for feature in ("F1", "F2", "SMOOTH_F1"):
            cases[f"{metric} {feature}"] = make("Distance", inputs=inputs, distance=metric, feature=feature)
    check(cases, SNAPPED, scale=0.1, offset=1.0)


def test_patterns():
    cases = {}
    for output in ("Color", "Fac"):
        cases[f"checker {output}"] = case("ShaderNodeTexChecker", output, {"Scale": 5.0})
        bricks = {"Scale": 5.0, "Mortar Size": 0.07}
        cases[f"brick {output}"] = case("ShaderNodeTexBrick", output, bricks, exact=False)
        cases[f"brick squashed {output}"] = case(
            "ShaderNodeTexBrick",
            output,
            {"Scale": 3.0, "Mortar Size": 0.1, "Mortar Smooth": 0.7, "Bias": -0.3, "Row Height": 0.3},
            offset=0.3,
            offset_frequency=3,
            squash=0.6,
            squash_frequency=2,
        )
    cases["checker on its edges"] = case("ShaderNodeTexChecker", "Fac", {"Scale": 8.0}, scale=2.0)
    for depth in range(11):
        inputs = {"Scale": 3.0, "Distortion": 1.7}
        cases[f"magic {depth}"] = case("ShaderNodeTexMagic", "Color", inputs, 4.0, turbulence_depth=depth)
    for kind in ("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"):
        cases[f"gradient {kind}"] = case("ShaderNodeTexGradient", "Fac", gradient_type=kind)
    for dimensions in DIMENSIONS:
        flat = " flat" if dimensions == "1D" else ""
        for output in ("Value", "Color"):
            settings = {"noise_dimensions": dimensions}
            cases[f"white noise {dimensions} {output}{flat}"] = case(
                "ShaderNodeTexWhiteNoise", output, {"W": 0.37}, **settings
            )
    check(cases, SMOOTH)


def test_wave_and_gabor():
    cases = {}
    inputs = {"Scale": 1.7, "Distortion": 2.0, "Detail": 2.5, "Detail Scale": 1.3, "Phase Offset": 0.4}
    for direction in ("X", "Y", "Z", "DIAGONAL"):
        for profile in ("SIN", "SAW", "TRI"):
            settings = {"bands_direction": direction, "wave_profile": profile}
            cases[f"bands {direction} {profile}"] = case("ShaderNodeTexWave", "Fac", inputs, **settings)
    for direction in ("X", "Y", "Z", "SPHERICAL"):
        settings = {"wave_type": "RINGS", "rings_direction": direction}
        cases[f"rings {direction}"] = case("ShaderNodeTexWave", "Color", inputs, **settings)
    for kind in ("2D", "3D"):
        for output in ("Value", "Phase", "Intensity"):
            for anisotropy in (1.0, 0.4):
                inputs = {"Scale": 3.0, "Anisotropy": anisotropy, "Orientation 2D": 0.3}
                name = f"gabor {kind} {output} {anisotropy}"
                cases[name] = case("ShaderNodeTexGabor", output, inputs, gabor_type=kind)
    check(cases, 1e-4)


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="Radial Tiling is of Blender 5")
def test_radial_tiling():
    cases = {}
    for sides in (2.0, 2.5, 4.5, 5.0):
        for roundness in (0.0,) if sides == 2.0 else (0.0, 0.4, 0.8, 1.0):
            inputs = {"Sides": sides, "Roundness": roundness}
            for normalize in (False, True):
                settings = {"inputs": inputs, "normalize": normalize}
                name = f"{sides} sides, roundness {roundness}, normalized {normalize}"
                cases[name] = case("ShaderNodeRadialTiling", "Segment Coordinates", **settings)
        for output in ("Segment ID", "Segment Width", "Segment Rotation"):
            flat = "" if sides % 1.0 or output != "Segment Width" else " flat"
            cases[f"{output}, {sides} sides{flat}"] = case("ShaderNodeRadialTiling", output, inputs)
    check(cases, SNAPPED, scale=0.1, offset=1.0)


def test_coordinates_of_unlinked_textures():
    def unlinked(identifier):
        return lambda tree: add_node(tree, identifier).outputs[0]

    def picture(identifier):
        return lambda tree: add_node(tree, identifier, image=new_image(64, 64)).outputs[0]

    names = ("Noise", "Voronoi", "Wave", "Magic", "Gradient", "Checker", "Brick", "Gabor")
    cases = {name: unlinked(f"ShaderNodeTex{name}") for name in names}
    cases["White Noise flat"] = unlinked("ShaderNodeTexWhiteNoise")
    cases["Image"] = picture("ShaderNodeTexImage")
    cases["Environment"] = picture("ShaderNodeTexEnvironment")
    check(cases, SMOOTH)


def test_mapping_of_the_node_itself():
    def mapped(**settings):
        def build(tree):
            node = add_node(tree, "ShaderNodeTexGradient", gradient_type="DIAGONAL")
            node.color_mapping.brightness = 1.7  # which Cycles ignores
            tree.links.new(snapped(tree), node.inputs["Vector"])
            for key, setting in settings.items():
                setattr(node.texture_mapping, key, setting)
            return node.outputs["Fac"]

        return build

    turn = {"rotation": (0.3, 0.2, 0.5), "scale": (1.5, 0.7, 2.0), "translation": (0.4, 0.3, 0.0)}
    cases = {kind: mapped(vector_type=kind, **turn) for kind in ("TEXTURE", "POINT", "VECTOR", "NORMAL")}
    cases["swapped"] = mapped(mapping_x="Y", mapping_y="X", mapping_z="NONE", translation=(0.5, 0.2, 0.0))
    cases["limited"] = mapped(use_min=True, use_max=True, min=(0.1, 0.1, 0.0), max=(0.3, 0.5, 1.0))
    check(cases, SNAPPED)


def pixels(width, height, alpha=False, seed=1):
    values = np.random.default_rng(seed).random((height, width, 4)).astype(np.float32)
    if not alpha:
        values[..., 3] = 1.0
    return values


def new_image(width=7, height=5, alpha=False, is_float=False, scale=1.0):
    image = bpy.data.images.new("image", width, height, alpha=True, float_buffer=is_float)
    values = pixels(width, height, alpha)
    values[..., :3] *= scale
    image.pixels.foreach_set(values.ravel())
    return image


def saved_image(path, alpha=False, is_float=False, scale=1.0):
    """An image file of the two kinds that matter: 8-bit PNG, float EXR."""
    image = new_image(alpha=alpha, is_float=is_float, scale=scale)
    image.filepath_raw = str(path)
    image.file_format = "OPEN_EXR" if is_float else "PNG"
    image.save()
    bpy.data.images.remove(image)
    return bpy.data.images.load(str(path))


def image_case(make, output="Color", coordinates="UV", scale=2.5, offset=-0.7, **settings):
    def build(tree):
        texture = add_node(tree, settings.pop("node", "ShaderNodeTexImage"), image=make(), **settings)
        vector = add_node(tree, "ShaderNodeTexCoord").outputs[coordinates]
        inputs = {"Vector": vector, "Vector_001": (scale,) * 3, "Vector_002": (offset,) * 3}
        mapped = add_node(tree, "ShaderNodeVectorMath", operation="MULTIPLY_ADD", inputs=inputs)
        tree.links.new(mapped.outputs[0], texture.inputs["Vector"])
        if output != "Both":
            return texture.outputs[output]
        # Colours are divided by alpha only where the alpha output is used.
        inputs = {"Value": texture.outputs["Alpha"], "Value_001": 1e-7}
        trace = add_node(tree, "ShaderNodeMath", operation="MULTIPLY", inputs=inputs)
        inputs = {"Vector": texture.outputs["Color"], "Vector_001": trace.outputs[0]}
        return add_node(tree, "ShaderNodeVectorMath", operation="ADD", inputs=inputs).outputs[0]

    return build


def test_image_lookups():
    cases = {}
    for extension in ("REPEAT", "EXTEND", "CLIP", "MIRROR"):
        for interpolation in ("Linear", "Closest", "Cubic", "Smart"):
            name = f"{extension} {interpolation}"
            cases[name] = image_case(new_image, extension=extension, interpolation=interpolation)
    large = partial(new_image, 64, 64)
    for blend in (0.0, 0.2, 1.0):
        cases[f"box {blend}"] = image_case(large, "Color", "Object", 1.0, 0.0, projection="BOX", projection_blend=blend)
    for projection in ("SPHERE", "TUBE"):
        cases[projection] = image_case(large, "Color", "Generated", 1.0, 0.0, projection=projection)
    for projection in ("EQUIRECTANGULAR", "MIRROR_BALL"):
        cases[projection] = image_case(
            partial(new_image, 32, 16),
            "Color",
            "Object",
            1.0,
            0.0,
            node="ShaderNodeTexEnvironment",
            projection=projection,
        )
    cases["missing flat"] = image_case(lambda: None)
    check(cases, 6e-4)


def test_images_with_alpha(tmp_path):
    cases = {}
    for mode in ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"):
        for is_float in (False, True):
            for storage in ("generated", "file", "packed"):

                def make(mode=mode, is_float=is_float, storage=storage):
                    kind = "exr" if is_float else "png"
                    path = tmp_path / f"{mode}{is_float}{storage}.{kind}"
                    image = new_image(alpha=True, is_float=is_float, scale=3.0 if is_float else 1.0)
                    if storage != "generated":
                        image = saved_image(path, True, is_float, 3.0 if is_float else 1.0)
                        image.colorspace_settings.name = "Linear Rec.709" if is_float else "sRGB"
                    image.alpha_mode = mode
                    if storage == "packed":
                        image.pack()
                    return image

                for output in ("Color", "Alpha", "Both"):
                    flat = " flat" if (mode, output) == ("NONE", "Alpha") else ""
                    name = f"{mode} {'float' if is_float else 'byte'} {storage} {output}{flat}"
                    cases[name] = image_case(make, output)
    check(cases, SMOOTH)


def test_colour_spaces(tmp_path):
    cases = {}
    for space in ("sRGB", "Non-Color", "Linear Rec.709", "Filmic sRGB", "Rec.1886", "Display P3", "Linear Rec.2020"):

        def make(space=space):
            image = saved_image(tmp_path / f"{space}.png")
            image.colorspace_settings.name = space
            return image

        cases[space] = image_case(make)
    check(cases, HALF)


def test_frames_and_tiles(tmp_path):
    def flat(path, value):
        image = bpy.data.images.new("flat", 4, 4)
        image.pixels.foreach_set(np.tile(np.array([value, value, value, 1.0], np.float32), 16))
        image.filepath_raw, image.file_format = str(path), "PNG"
        image.save()
        bpy.data.images.remove(image)

    for number in range(6):
        flat(tmp_path / f"frame_{number:03d}.png", number / 10.0)
    for number, value in ((1001, 0.2), (1002, 0.5), (1011, 0.9)):
        flat(tmp_path / f"tile.{number}.png", value)

    def sequence(start, offset, duration, cyclic):
        def build(tree):
            image = bpy.data.images.load(str(tmp_path / "frame_001.png"))
            image.source = "SEQUENCE"
            node = add_node(tree, "ShaderNodeTexImage", image=image)
            user = node.image_user
            user.frame_start, user.frame_offset, user.frame_duration, user.use_cyclic = start, offset, duration, cyclic
            bpy.context.scene.frame_current = 7
            return node.outputs["Color"]

        return build

    def tiled(packed):
        image = bpy.data.images.load(str(tmp_path / "tile.1001.png"))
        image.source = "TILED"
        image.filepath = str(tmp_path / "tile.<UDIM>.png")
        for number in (1002, 1011):
            image.tiles.new(number)
        image.reload()
        if packed:
            image.pack()
        return image

    cases = {
        "clamped flat": sequence(1, 0, 5, False),
        "cyclic flat": sequence(2, 1, 4, True),
        "no duration flat": sequence(1, 2, 0, False),
        "tiles": image_case(partial(tiled, False), scale=3.5, offset=-0.9, interpolation="Closest"),
        "packed tiles": image_case(partial(tiled, True), scale=3.5, offset=-0.9, interpolation="Closest"),
    }
    check(cases, SMOOTH)


def sky_case(**settings):
    """A sky seen through the UV map: u is the azimuth, v the height."""

    def build(tree):
        uv = add_node(tree, "ShaderNodeTexCoord").outputs["UV"]
        split = add_node(tree, "ShaderNodeSeparateXYZ", inputs={"Vector": uv})

        def math(operation, *values):
            inputs = {("Value", "Value_001", "Value_002")[i]: value for i, value in enumerate(values)}
            return add_node(tree, "ShaderNodeMath", operation=operation, inputs=inputs).outputs[0]

        azimuth = math("MULTIPLY_ADD", split.outputs[0], 7.0, -3.5)
        height = math("MULTIPLY_ADD", split.outputs[1], 2.0, -0.5)
        flat = math("COSINE", height)
        direction = {
            "X": math("MULTIPLY", flat, math("COSINE", azimuth)),
            "Y": math("MULTIPLY", flat, math("SINE", azimuth)),
            "Z": math("SINE", height),
        }
        vector = add_node(tree, "ShaderNodeCombineXYZ", inputs=direction).outputs[0]
        node = add_node(tree, "ShaderNodeTexSky", **settings)
        tree.links.new(vector, node.inputs["Vector"])
        return node.outputs[0]

    return build


def test_skies():
    before_5 = bpy.app.version < (5, 0, 0)
    cases = {}
    for kind in ("NISHITA",) if before_5 else ("SINGLE_SCATTERING", "MULTIPLE_SCATTERING"):
        make = partial(sky_case, sky_type=kind, sun_disc=False)
        cases[kind] = make()
        cases[f"{kind} turned"] = make(sun_rotation=2.0, sun_elevation=0.6)
        cases[f"{kind} after sunset"] = make(sun_elevation=-0.05)
        dense = {"dust_density" if before_5 else "aerosol_density": 3.0, "air_density": 2.0, "ozone_density": 4.0}
        cases[f"{kind} dense"] = make(sun_elevation=0.3, altitude=2000.0, **dense)
    cases["Preetham"] = sky_case(sky_type="PREETHAM", sun_direction=(0.6, -0.5, 0.3), turbidity=5.0)
    for name, parity in compare(cases).items():
        error = np.abs(parity.ours - parity.cycles) / np.maximum(parity.cycles, 0.02 * parity.cycles.max())
        assert error.max() < 0.005, name


@pytest.mark.parametrize("identifier", ["ShaderNodeTexIES", "ShaderNodeTexPointDensity"])
def test_what_is_not_supported_warns(identifier):
    from restir_engine.scene.description import SceneDescription
    from restir_engine.sync.nodes import Compiler

    if not hasattr(bpy.types, identifier):
        pytest.skip("this Blender has no such node")
    material = bpy.data.materials.new("Odd")
    material.use_nodes = True
    tree = material.node_tree
    emission = add_node(tree, "ShaderNodeEmission")
    tree.links.new(add_node(tree, identifier).outputs[0], emission.inputs["Color"])
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    scene = SceneDescription()
    program = Compiler(scene, "Material", "Odd").compile(tree)
    assert len(program.code)
    assert any("Odd" in line for line in scene.warnings.lines())
