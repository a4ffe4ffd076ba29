"""What the benchmarks render."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from testing.blender import kit, render
from testing.blender.registry import Scene


def diffuse() -> None:
    """Suzanne, smooth and subdivided, on a floor, diffuse, under one area light."""
    kit.floor()
    monkey = kit.put("monkey", kit.diffuse((0.8, 0.5, 0.3)), (0.0, 0.0, 1.0))
    monkey.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    kit.lamp(500)
    kit.world(lambda node: node("Background", Strength=0.0))


def _textures(count: int = 10, size: int = 256) -> list[bpy.types.Image]:
    """Images of smooth random colours."""
    random = np.random.default_rng(7)
    coarse = random.random((count, size // 8, size // 8, 3)).repeat(8, 1).repeat(8, 2)
    alpha = np.ones((size, size, 1))
    return [kit.image(f"Texture {i}", np.concatenate([values, alpha], 2)) for i, values in enumerate(coarse)]


# Materials by the BSDF node and the inputs that the texture does not give.
LOBES: tuple[tuple[str, dict], ...] = (
    ("BsdfDiffuse", dict(Roughness=0.5)),
    ("BsdfPrincipled", dict(Roughness=0.4, Coat_Weight=1.0, Coat_Roughness=0.1, Sheen_Weight=0.5)),
    ("BsdfPrincipled", dict(Metallic=1.0, Roughness=0.3, Anisotropic=0.6)),
    ("BsdfPrincipled", dict(Transmission_Weight=0.8, Roughness=0.2)),
    ("BsdfGlass", dict(Roughness=0.0)),
    ("BsdfAnisotropic", dict(Roughness=0.3, distribution="BECKMANN")),
    ("BsdfTranslucent", {}),
    ("BsdfToon", dict(Size=0.6, Smooth=0.2)),
    ("BsdfSheen", dict(Roughness=0.5)),
    ("BsdfRefraction", dict(Roughness=0.2, IOR=1.3)),
)


def all_lobes() -> None:
    """Ten objects, each with another BSDF and an image texture of its own, under an HDRI and an area light."""
    for i, (picture, (kind, inputs)) in enumerate(zip(_textures(), LOBES, strict=True)):

        def build(node, picture=picture, kind=kind, inputs=inputs):
            color = "Base_Color" if kind == "BsdfPrincipled" else "Color"
            return node(kind, **{color: node("TexImage", image=picture)}, **inputs)

        if i == 0:
            kit.floor(kit.material(build))
        else:
            kit.put("ball", kit.material(build), (-2.6 + 1.3 * ((i - 1) % 5), 0.7 - 1.5 * ((i - 1) // 5), 0.6), 0.6)
    kit.lamp()
    kit.hdri("courtyard", 1.0)


def million_triangles() -> None:
    """A wavy grid of 708 × 708 quadrilaterals, 1,002,528 triangles, smooth, with UVs."""
    n = 709
    y, x = np.mgrid[0:n, 0:n].astype(np.float32) / (n - 1) - 0.5
    z = 0.04 * np.sin(40 * x) * np.cos(30 * y)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.stack([corner, corner + 1, corner + n + 1, corner + n], 1).astype(np.int32)
    mesh = bpy.data.meshes.new("Waves")
    mesh.vertices.add(n * n)
    mesh.vertices.foreach_set("co", (8 * np.stack([x, y, z], 2)).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", faces.ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 4, dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    uv = mesh.uv_layers.new(name="UVMap")
    uv.data.foreach_set("uv", np.stack([x, y], 2).reshape(-1, 2)[faces.ravel()].ravel() + np.float32(0.5))
    mesh.update(calc_edges=True)
    mesh.materials.append(kit.diffuse())
    kit.add(mesh)
    kit.lamp()


def skin() -> None:
    """Suzanne of skin, random walks, under an HDRI and an area light."""
    flesh = kit.principled(
        Base_Color=(0.8, 0.5, 0.4, 1.0), Subsurface_Weight=1.0, Subsurface_Radius=(1.0, 0.35, 0.2),
        Subsurface_Scale=0.1, Roughness=0.4,
    )  # fmt: skip
    monkey = kit.put("monkey", flesh)
    monkey.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    kit.camera((0.0, -3.2, 0.4), (0.0, 0.0, 0.0))
    kit.lamp(300)
    kit.hdri("studio", 0.5)


def lanterns(count: int = 400) -> None:
    """Coloured lamps of unlike power all about diffuse and subsurface scattering objects."""
    random = np.random.default_rng(11)
    wax = kit.principled(Base_Color=(0.9, 0.6, 0.4, 1), Subsurface_Weight=1.0, Subsurface_Radius=(0.3, 0.12, 0.06))
    kit.floor(size=6.0)
    kit.put("monkey", kit.diffuse((0.8, 0.5, 0.3)), (-1.5, 0.2, 0.9), 0.8)
    kit.put("ball", wax, (0.2, 0.6, 0.7), 0.7)
    kit.put("monkey", wax, (1.7, -0.2, 0.8), 0.7)
    kit.put("cube", kit.diffuse((0.4, 0.6, 0.8)), (0.2, -1.4, 0.3), 0.3, rotation=(0, 0, 30))
    for place, hue, power in zip(
        random.uniform((-4, -3, 0.15), (4, 4, 3), (count, 3)),
        random.random(count),
        random.lognormal(0.0, 1.0, count),
        strict=True,
    ):
        color = [0.5 + 0.5 * np.cos(2.0 * np.pi * (hue + shift / 3.0)) for shift in range(3)]
        kit.light("POINT", 0.6 * power, place, shadow_soft_size=0.03, color=color)


def _scattering(color: tuple, radius: tuple, scale: float, **inputs) -> bpy.types.Material:
    """A body in which light walks at random."""
    return kit.principled(
        Base_Color=(*color, 1.0), Subsurface_Weight=1.0, Subsurface_Radius=radius, Subsurface_Scale=scale, **inputs
    )


def slab() -> None:
    """A plate of wax that a lamp lights from behind."""
    plate = kit.put("cube", _scattering((0.9, 0.7, 0.5), (1.0, 0.6, 0.4), 0.2, Roughness=0.5), (0.0, 0.0, 1.0), 1.0)
    plate.scale = 1.2, 0.1, 0.9
    kit.floor()
    kit.light("AREA", 200.0, (0.6, 2.5, 2.5), (0.0, 0.0, 1.0), size=1.0)


def jade() -> None:
    """A head of jade under an HDRI."""
    stone = _scattering((0.35, 0.65, 0.4), (0.6, 1.0, 0.7), 0.15, Roughness=0.15)
    monkey = kit.put("monkey", stone)
    monkey.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    kit.camera((0.0, -3.2, 0.4), (0.0, 0.0, 0.0))
    kit.hdri("courtyard", 1.0)


def _things() -> None:
    """What is lit in scenes that are about light."""
    kit.put("monkey", kit.diffuse((0.8, 0.5, 0.3)), (-1.1, 0.0, 0.9), 0.8)
    kit.put("ball", kit.principled(Base_Color=(0.3, 0.5, 0.8, 1.0), Roughness=0.3), (0.7, 0.4, 0.6), 0.6)
    kit.put("cube", kit.diffuse((0.4, 0.7, 0.4)), (1.9, 0.2, 0.5), 0.5, rotation=(0, 0, 30))


def _walls(*sides: tuple) -> None:
    """Walls, each by the arguments of its plane's placing."""
    wall = kit.diffuse((0.7, 0.7, 0.7))
    for place, scale, rotation in sides:
        kit.put("plane", wall, place, scale, rotation=rotation)


CEILING, BACK, RIGHT = (
    ((0, 0, 4), 4.0, (180, 0, 0)),
    ((0, 4, 2), (4.0, 2.0, 1.0), (90, 0, 0)),
    ((4, 0, 2), (2.0, 4.0, 1.0), (0, 90, 0)),
)
LEFT, FRONT = ((-4, 0, 2), (2.0, 4.0, 1.0), (0, 90, 0)), ((0, -4, 2), (4.0, 2.0, 1.0), (90, 0, 0))


def room() -> None:
    """A closed room with one lamp."""
    kit.floor()
    _things()
    _walls(CEILING, BACK, RIGHT, LEFT, FRONT)
    kit.camera((0.0, -3.8, 1.8), (0.2, 0.0, 1.0), lens=28)
    kit.light("AREA", 120.0, (1.0, 0.5, 3.8), (1.0, 0.5, 0.0), size=0.5)


def sun_and_sky() -> None:
    """A sky and a sun on things outdoors."""
    kit.floor()
    _things()
    kit.world(lambda node: node("Background", Color=node("TexSky", sun_disc=False), Strength=0.2))
    kit.light("SUN", 3.0, (-3.0, -2.0, 4.0), angle=0.01)


def window() -> None:
    """A room that sky and sun reach through a window, and a lamp in it."""
    kit.floor()
    _things()
    _walls(CEILING, BACK, RIGHT, FRONT)
    _walls(((-4, -2.5, 2), (2.0, 1.5, 1.0), (0, 90, 0)), ((-4, 2.5, 2), (2.0, 1.5, 1.0), (0, 90, 0)))
    kit.camera((0.0, -3.8, 1.8), (0.2, 0.0, 1.0), lens=28)
    kit.world(lambda node: node("Background", Color=node("TexSky", sun_disc=False), Strength=0.2))
    kit.light("SUN", 3.0, (-6.0, 1.0, 3.0), angle=0.01)
    kit.light("POINT", 30.0, (1.5, -0.5, 2.5), shadow_soft_size=0.1)


def screen() -> None:
    """A luminous picture and a lamp."""
    kit.floor()
    _things()
    pixels = np.zeros((64, 64, 4), np.float32)
    pixels[..., 3] = 1.0
    pixels[8:20, 8:20, :3], pixels[40:56, 30:34, :3] = (1.0, 0.2, 0.1), (0.1, 0.4, 1.0)
    picture = kit.image("screen", pixels)
    glow = kit.material(lambda node: node("Emission", Color=node("TexImage", image=picture), Strength=20.0))
    kit.put("plane", glow, (-3.2, 0.5, 1.6), 1.2, rotation=(0, 90, 0))
    kit.lamp(100)


def glass() -> None:
    """Things of glass, clear and rough, under an HDRI and a lamp."""
    kit.floor()
    for x, roughness in ((-1.4, 0.0), (0.0, 0.2), (1.4, 0.5)):
        kit.put("ball", kit.material(lambda node, r=roughness: node("BsdfGlass", Roughness=r)), (x, 0.0, 0.6), 0.6)
    kit.lamp()
    kit.hdri("studio", 0.5)


def _scene(build: Callable[[], None], size: tuple[int, int], bounces: int) -> Scene:
    limits = dict.fromkeys(("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"), bounces)
    return Scene(build.__name__, build, 0, 1, size, limits)


BUILDS = (
    diffuse, skin, slab, jade, room, lanterns, screen, window, sun_and_sky, glass, all_lobes, million_triangles,
)  # fmt: skip


def prepare(name: str, size: tuple[int, int] = (640, 360)) -> None:
    """Build the scene of this name in an empty file."""
    builds = {build.__name__: (build, 8 if build in (all_lobes, glass) else 4) for build in BUILDS}
    build, bounces = builds[name]
    render.prepare(_scene(build, size, bounces))
