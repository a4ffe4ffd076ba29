"""A picture by shape alone, without compiled kernels: what is seen until these are there."""

from __future__ import annotations

import numpy as np

from ..embree.first_hits import first_hits
from ..embree.scenes import Placed, WorldScene
from ..kernels.core.records import RAY_CAMERA
from .camera import Camera
from .description import SceneDescription
from .mesh import Mesh
from .trees import Trees

_RAYS = 8_000  # at 1.5 µs each
_GREY, _BACKGROUND = 0.6, 0.05


def plain_picture(scene: SceneDescription, camera: Camera, trees: Trees) -> np.ndarray | None:
    """A coarse picture (height, width, 4) of the meshes, lit from the eye; None of a panorama."""
    if camera.kind == "PANO":
        return None
    width, height = camera.film_size
    camera = camera.coarser(max(1, round((width * height / _RAYS) ** 0.5)))
    width, height = camera.film_size
    rows = scene.instances
    transforms = np.ascontiguousarray(rows["to_world"], np.float32)
    is_mesh = np.array([isinstance(shape, Mesh) for shape in scene.meshes], bool)  # other shapes need compiled code
    masks = np.where(is_mesh[rows["mesh"]], rows["seen_by"] & RAY_CAMERA, 0)
    content = [
        Placed(mask, transform, scene=trees.of(scene.meshes[mesh]) if mask else None)
        for mesh, transform, mask in zip(rows["mesh"].tolist(), transforms, masks.tolist(), strict=True)
    ]
    o, d = _rays(camera, width, height)
    instance, normal = first_hits(WorldScene(content), o, d)
    result = np.empty((height * width, 4), np.float32)
    result[:, :3], result[:, 3] = _BACKGROUND, 1.0
    hit = np.flatnonzero(instance >= 0)
    inverse = rows["to_object"][instance[hit]].reshape(-1, 3, 4)[:, :, :3]
    n = np.einsum("nji,nj->ni", inverse, normal[hit])
    n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-30)
    result[hit, :3] = _GREY * (0.2 + 0.8 * np.abs((n * d[hit]).sum(1)))[:, None]
    return result.reshape(height, width, 4)


def _rays(camera: Camera, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Origins and unit directions (n, 3) of the rays through all pixels' middles, bottom row first."""
    x0, y0 = (camera.region or (0, 0))[:2]
    left, right, bottom, top = camera.screen
    x = left + (right - left) * (x0 + np.arange(width) + 0.5) / camera.width
    y = bottom + (top - bottom) * (y0 + np.arange(height) + 0.5) / camera.height
    x, y = (grid.ravel() for grid in np.meshgrid(x, y))
    axes = camera.to_world[:, :3] / np.linalg.norm(camera.to_world[:, :3], axis=0)
    if camera.kind == "ORTHO":
        o = camera.to_world[:, 3] + np.column_stack([x, y, np.full(len(x), -camera.clip_start)]) @ axes.T
        return o, np.broadcast_to(-axes[:, 2], o.shape)
    d = np.column_stack([x, y, np.full(len(x), -1.0)]) @ axes.T
    o = camera.to_world[:, 3] + camera.clip_start * d
    return o, d / np.linalg.norm(d, axis=1, keepdims=True)
