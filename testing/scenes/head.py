"""A head of skin under a lamp, seen from several distances; from RESTIR_ASSETS, else a ball with deep folds."""

from __future__ import annotations

import json
import os
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np

from restir_engine.scene.camera import Camera
from restir_engine.scene.lamps import area_lamp
from restir_engine.scene.mesh import Mesh
from restir_engine.scene.scene import Scene
from testing.scenes.lights import matrix
from testing.scenes.rooms import UNSEEN, Builder, look
from testing.scenes.scattering import subsurface_program
from testing.scenes.shapes import icosphere

COLOR = (0.8, 0.5, 0.4)
MEAN_FREE_PATHS = 0.1 * np.array([1.0, 0.35, 0.2])  # of a head 8.6 units high
EYE, FACE = (0.9, -14.0, 0.6), (0.6, 0.0, 0.4)
_DISTANCE = 11.8  # from the eye to the face
_TYPES = {5123: np.uint16, 5126: np.float32}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def head() -> Mesh:
    """Lee Perry-Smith's head, z up, looking along -y; the ball where there are no assets."""
    path = Path(os.environ.get("RESTIR_ASSETS", "")) / "head_lps" / "LeePerrySmith.glb"
    if not path.is_file():
        vertices, triangles = icosphere(2.8, 5)
        folds = 1.0 + 0.2 * np.sin(2.5 * vertices[:, :1]) * np.sin(2.5 * vertices[:, 2:])
        return Mesh(vertices * folds, triangles)
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    tree, body = json.loads(data[20 : 20 + length]), data[28 + length :]

    def array(index: int) -> np.ndarray:
        accessor = tree["accessors"][index]
        view, width = tree["bufferViews"][accessor["bufferView"]], _WIDTHS[accessor["type"]]
        found = np.frombuffer(body, _TYPES[accessor["componentType"]], accessor["count"] * width, view["byteOffset"])
        return found.reshape(-1, width)

    part = tree["meshes"][0]["primitives"][0]
    points, normals = (array(part["attributes"][name])[:, [0, 2, 1]] * (1, -1, 1) for name in ("POSITION", "NORMAL"))
    triangles = array(part["indices"]).reshape(-1, 3)
    return Mesh(points, triangles, normals=normals.astype(np.float32), smooth=np.ones(len(triangles), bool))


def head_scene(entry: str, g: float = 0.0) -> Scene:
    """The head, whose medium light enters by an ENTRIES name, under one lamp from the side."""
    b = Builder()
    b.add(head(), subsurface_program(COLOR, MEAN_FREE_PATHS, g, entry=entry), matrix())
    lamp = matrix((4.0, -8.0, 5.0), (4.0, -8.0, 4.0))
    b.lamp(area_lamp(lamp, 1500.0 * np.ones(3), 1.0, 1.0, seen_by=UNSEEN))
    return b.finish(look(EYE, FACE))


def camera_for(spacing: float, size: int) -> Camera:
    """A camera for whose pixels that are so many mean free paths of red light apart on the face."""
    half = 0.5 * size * spacing * float(MEAN_FREE_PATHS[0]) / _DISTANCE
    return replace(look(EYE, FACE, size), screen=(-half, half, -half, half))
