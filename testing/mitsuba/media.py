"""The same media in Mitsuba 3 (volpath) and here: a closed mesh in a white world, under a bright square."""

import mitsuba as mi
import numpy as np

from restir_engine.scene.scene import Scene
from restir_engine.scene.voxels import VoxelAttribute, box_mesh
from testing.scenes.lights import emission_program, matrix
from testing.scenes.media import grid_medium, medium, stage
from testing.scenes.rooms import look, render, scaled
from testing.scenes.shapes import QUAD

mi.set_variant("scalar_rgb")

GROUPS = 16
EYE, TARGET = (0.5, -3.2, 1.2), (0.0, 0.0, 0.0)
LAMP = 6.0  # radiance of the square above
MANY = {name: 1000 for name in ("max_bounces", "volume_bounces", "transmission_bounces", "glossy_bounces")}


def ball(levels: int = 3) -> tuple[list, list]:
    """A sphere of flat triangles, radius 1: a subdivided octahedron."""
    points = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    points = [np.array(p, float) for p in points]
    for _ in range(levels):
        known: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, known=known) -> int:
            key = (min(a, b), max(a, b))
            if key not in known:
                p = points[a] + points[b]
                points.append(p / np.linalg.norm(p))
                known[key] = len(points) - 1
            return known[key]

        faces = [
            corner
            for a, b, c in faces
            for ab, bc, ca in [(middle(a, b), middle(b, c), middle(c, a))]
            for corner in ([a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca])
        ]
    return np.array(points).tolist(), faces


def our_scene(shape, sigma_t, albedo, g, glass, size: int) -> Scene:
    """The scene for `our_frames`; `glass` as in `scenes.media.medium`."""
    b = stage()
    scattering = np.multiply(sigma_t, albedo)
    b.add(shape, medium(np.subtract(sigma_t, scattering), scattering, g=g, glass=glass), matrix())
    b.add(QUAD, emission_program((LAMP,) * 3), scaled(matrix((0.0, 0.0, 2.5), (0.0, 0.0, -1.0)), 0.8, 0.8, 1.0))
    return b.finish(look(EYE, TARGET, size))


def our_grid_scene(values: np.ndarray, sigma_t, albedo, g, size: int) -> Scene:
    """The same with a cube from -1 to 1 that voxels (nx, ny, nz) fill, zeros at its sides: factors of sigma_t."""
    b = stage()
    name = b.scene.attribute_name("density")
    edges = 2.0 / np.array(values.shape)
    to_index = np.column_stack([np.diag(1.0 / edges), 1.0 / edges - 0.5])
    scattering = np.multiply(sigma_t, albedo)
    material = grid_medium(name, np.subtract(sigma_t, scattering), scattering, g)
    b.add(box_mesh("grid", [VoxelAttribute(name, values, to_index)]), material, matrix())
    b.add(QUAD, emission_program((LAMP,) * 3), scaled(matrix((0.0, 0.0, 2.5), (0.0, 0.0, -1.0)), 0.8, 0.8, 1.0))
    return b.finish(look(EYE, TARGET, size))


def our_frames(scene: Scene, samples: int) -> np.ndarray:
    """(GROUPS, height, width, 3), rows bottom to top."""
    return np.stack([render(scene, samples, seed=seed, pixel_filter="BOX", **MANY) for seed in range(GROUPS)])


def _mesh(shape, properties: mi.Properties) -> mi.Mesh:
    vertices, triangles = (np.asarray(a) for a in shape)
    mesh = mi.Mesh("mesh", len(vertices), len(triangles), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ravel(vertices).astype(np.float32)
    parameters["faces"] = np.ravel(triangles).astype(np.uint32)
    parameters.update()
    return mesh


def mitsuba_frames(shape, sigma_t, albedo, g, glass, size: int, samples: int, values=None) -> np.ndarray:
    """The same images by Mitsuba's volpath; values: voxels as in `our_grid_scene`, sigma_t then a number."""
    surface: dict = {"type": "null"}
    if glass is not None:
        surface = {"type": "dielectric", "int_ior": glass[1], "ext_ior": 1.0}
        if glass[0] > 0.0:
            surface |= {"type": "roughdielectric", "distribution": "ggx", "alpha": glass[0] ** 2}
    rgb = {"type": "rgb"}
    inside = {
        "type": "homogeneous",
        "albedo": rgb | {"value": list(np.broadcast_to(albedo, 3))},
        "sigma_t": rgb | {"value": list(np.broadcast_to(sigma_t, 3) / np.max(sigma_t))},
        "scale": float(np.max(sigma_t)),
        "phase": {"type": "hg", "g": g},
    }
    if values is not None:
        place = mi.ScalarTransform4f().translate(-1.0).scale(2.0)
        grid = mi.VolumeGrid(np.ascontiguousarray(values.transpose(2, 1, 0)[..., None], np.float32))
        inside |= {"type": "heterogeneous", "sigma_t": {"type": "gridvolume", "grid": grid, "to_world": place}}
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(surface)
    properties["interior"] = mi.load_dict(inside)
    properties["face_normals"] = True
    place = mi.ScalarTransform4f
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "volpathmis", "max_depth": -1, "rr_depth": 20},
            "sensor": {
                "type": "perspective",
                "fov": float(np.degrees(2.0 * np.arctan(0.5))),
                "near_clip": 0.1,
                "to_world": place().look_at(EYE, TARGET, (0, 0, 1)),
                "film": {
                    "type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}, "pixel_format": "rgb",
                    "component_format": "float32",
                },
                "sampler": {"type": "independent"},
            },
            "world": {"type": "constant", "radiance": 1.0},
            "lamp": {
                "type": "rectangle",
                "to_world": place().look_at((0, 0, 2.5), (0, 0, 0), (0, 1, 0)) @ place().scale(0.8),
                "emitter": {"type": "area", "radiance": LAMP},
            },
            "body": _mesh(shape, properties),
        }
    )  # fmt: skip
    return np.stack([np.array(mi.render(scene, spp=samples, seed=seed))[::-1, :, :3] for seed in range(GROUPS)])
