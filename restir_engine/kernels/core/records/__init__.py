"""The records through which scene, settings and working memory reach kernels, filed by subject.

An array stands in a record as its address (int64; 0: none) and, where needed, its length. The Python side
(`scene`, `session`) owns every array. A kernel takes records, so that its argument types never depend on the scene.
All matrices are row-major 3x4. Units are Blender's: scene units, radians, scene-linear radiance.
"""

# ruff: noqa: F403
from .geometry import *
from .lights import *
from .media import *
from .rays import *
from .render import *
from .scene import *
from .scratch import *
from .shading import *
