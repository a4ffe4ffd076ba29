"""What is to be rendered, while it is put together."""

from __future__ import annotations

import numpy as np

from ..kernels.core import records as rec
from . import names
from .camera import Camera
from .cryptomatte import Manifests
from .images import ImageTable
from .instances import InstanceSteps
from .lamps import Lamps
from .scene import Scene
from .shaders import ShaderTable
from .shape import Shape
from .shutter import Shutter
from .trees import Trees
from .vectors import Vectors
from .warnings import Warnings
from .world import World


class SceneDescription:
    """The parts of a scene, to be filled and changed at will; `commit` makes the scene that is rendered of them.

    attribute_names: the numbers of attributes by name, where other scenes' meshes are shown: names are added to it.
    """

    def __init__(self, attribute_names: dict[str, int] | None = None) -> None:
        self.meshes: list[Shape] = []
        self.instances = np.zeros(0, rec.INSTANCE)
        self.instance_steps: list[InstanceSteps] = []  # of those that move
        self.shutter: Shutter | None = None  # None: what is seen is one moment
        self.vectors: Vectors | None = None  # None: the pass Vector is not asked for
        self.material_slots = np.zeros(0, np.int32)
        self.instance_attributes: list = []  # what the instances' attribute tables need to stay alive
        self.shaders = ShaderTable()
        self.images = ImageTable()
        self.lights = Lamps()
        self.world = World()
        self.cameras: tuple[Camera, ...] = (Camera(),)  # all who look at it
        self.warnings = Warnings()
        self.manifests = Manifests()
        self.aovs: dict[str, tuple[int, int]] = {}  # name -> (first channel, how many) of what programs write
        self.light_groups: dict[str, int] = {}  # name -> number, of those of the view layer
        self.frame = 1  # what image sequences show
        self.time = 1.0  # the frame with its fraction
        self.frames_per_second = 24.0
        self.attribute_names = names.reserved() if attribute_names is None else attribute_names

    def attribute_name(self, name: str) -> int:
        """The number that stands for an attribute in programs and meshes; "" is the render UV map. See `names`."""
        return self.attribute_names.setdefault(name, len(self.attribute_names))

    @property
    def camera(self) -> Camera:
        """The first that looks at it, or the only one."""
        return self.cameras[0]

    @camera.setter
    def camera(self, camera: Camera) -> None:
        self.cameras = (camera,)

    def commit(self, trees: Trees | None = None, before: Scene | None = None) -> Scene:
        """The scene of what this describes now; later changes are not seen in it. Its meshes' arrays are read-only.

        trees: acceleration structures that earlier scenes have left. before: a scene whose tables of lights are taken
        over as far as they are what would be built. This needs no bpy, compiles the instructions that
        the programs use, and may take its time: it can run on a thread of its own.
        """
        return Scene(self, Trees() if trees is None else trees, before)
