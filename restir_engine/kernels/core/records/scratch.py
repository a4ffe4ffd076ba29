"""Working memory of one tile call: one block, owned by the session, 64-byte aligned. Areas are offsets in it."""

from ..jit import inlined
from ..memory import copy_words, record_address
from .geometry import INSTANCE
from .lights import LIGHT_SAMPLE, light_sample_at
from .media import MAX_MEDIA, MEDIA, MEDIUM, SHADOW
from .render import PATH, path_at
from .scene import CAMERA, SCENE, camera_at, scene_at
from .shading import CLOSURE, MAX_CLOSURES, MAX_REGISTERS, SHADING_POINT, shading_point_at

_RAY_BYTES = 96  # RTCRayHit
_MEDIA_BYTES = MEDIA.itemsize + MAX_MEDIA * MEDIUM.itemsize
_CLOSURE_BYTES = MAX_CLOSURES * CLOSURE.itemsize
_REGISTER_BYTES = 8 * MAX_REGISTERS + 2 * 128  # behind them the rays of a program's own: shading.ray_ops
_SHARED_BYTES = 32768
_RESAMPLING_BYTES = 8192


def _behind(area: int, n_bytes: int) -> int:
    """Where the area behind one of that size begins: at the next multiple of 64 bytes."""
    return (area + n_bytes + 63) // 64 * 64


SCRATCH_RAY = 0
SCRATCH_SHADOW_RAY = _behind(SCRATCH_RAY, _RAY_BYTES)
SCRATCH_LIGHT_SAMPLE = _behind(SCRATCH_SHADOW_RAY, _RAY_BYTES)
SCRATCH_POINT = _behind(SCRATCH_LIGHT_SAMPLE, LIGHT_SAMPLE.itemsize)  # SHADING_POINT of the path
SCRATCH_PATH = _behind(SCRATCH_POINT, SHADING_POINT.itemsize)
# SHADING_POINT of transparent shadows and of lights' programs:
SCRATCH_SHADOW_POINT = _behind(SCRATCH_PATH, PATH.itemsize)
SCRATCH_CLOSURES = _behind(SCRATCH_SHADOW_POINT, SHADING_POINT.itemsize)
SCRATCH_SHADOW_CLOSURES = _behind(SCRATCH_CLOSURES, _CLOSURE_BYTES)
SCRATCH_REGISTERS = _behind(SCRATCH_SHADOW_CLOSURES, _CLOSURE_BYTES)
SCRATCH_SHADOW_REGISTERS = _behind(SCRATCH_REGISTERS, _REGISTER_BYTES)
_SHARED = _behind(SCRATCH_SHADOW_REGISTERS, _REGISTER_BYTES)
SCRATCH_MEDIA = _behind(_SHARED, _SHARED_BYTES)  # MEDIA of the path's point, and of the shadow ray's
SCRATCH_SHADOW_MEDIA = _behind(SCRATCH_MEDIA, _MEDIA_BYTES)
SCRATCH_SHADOW = _behind(SCRATCH_SHADOW_MEDIA, _MEDIA_BYTES)
SCRATCH_TILE_WEIGHTS = _behind(SCRATCH_SHADOW, SHADOW.itemsize)  # of a group of points: lights.tile_weights.OUT_BYTES
SCRATCH_TAKER = _behind(SCRATCH_TILE_WEIGHTS, 1024)  # what takes a path's contributions, see contribute
TAKER_BYTES = 4096
_RESAMPLING = _behind(SCRATCH_TAKER, TAKER_BYTES)
# What follows a path's time: SCENE now and before, CAMERA likewise, instances (kernels.geometry.placed).
SCRATCH_SCENES = _behind(_RESAMPLING, _RESAMPLING_BYTES)
_SCENE_BYTES, _CAMERA_BYTES = _behind(0, SCENE.itemsize), _behind(0, CAMERA.itemsize)
_SCENE_WORDS, _CAMERA_WORDS = SCENE.itemsize // 8, CAMERA.itemsize // 8
SCRATCH_CAMERAS = SCRATCH_SCENES + 2 * _SCENE_BYTES
SCRATCH_PLACED = SCRATCH_CAMERAS + 2 * _CAMERA_BYTES
PLACES, PLACED_HEADER = 16, 24
PLACED_BYTES = PLACED_HEADER + INSTANCE.itemsize
SCRATCH_LEAVING = _behind(SCRATCH_PLACED, PLACES * PLACED_BYTES)  # of kernels.geometry.leaving
SCRATCH_BYTES = _behind(SCRATCH_LEAVING, 128)


def shared_area(n_bytes: int) -> int:
    """The area that stages use by turns, for one that needs `n_bytes`: nothing in it outlives the stage.

    Those that use it: hits of subsurface scattering, candidates of direct light.
    """
    if n_bytes > _SHARED_BYTES:
        raise ValueError(f"the shared area has {_SHARED_BYTES} bytes, {n_bytes} are needed")
    return _SHARED


def resampling_area(n_bytes: int) -> int:
    """The area of reuse, whose shifts may use the shared one."""
    if n_bytes > _RESAMPLING_BYTES:
        raise ValueError(f"the area of resampling has {_RESAMPLING_BYTES} bytes, {n_bytes} are needed")
    return _RESAMPLING


@inlined
def tile_scene(scene, scratch, which):
    """The tile's own copy of a SCENE, which has a time; which: 0, or 1 for that of the frame before."""
    own = scratch + SCRATCH_SCENES + which * _SCENE_BYTES
    copy_words(own, record_address(scene), _SCENE_WORDS)
    scene = scene_at(own, 0)
    scene.time = 0.5
    scene.placed = scratch + SCRATCH_PLACED if scene.shutter != 0 else 0
    return scene


@inlined
def go_over(scene, other):
    """Make the tile's own copy of a SCENE one of the SCENE at an address, at the same time."""
    time, placed = scene.time, scene.placed
    copy_words(record_address(scene), other, _SCENE_WORDS)
    scene.time, scene.placed = time, placed


@inlined
def tile_camera(camera, scratch, which):
    """The tile's own copy of a CAMERA, which moves with time."""
    own = scratch + SCRATCH_CAMERAS + which * _CAMERA_BYTES
    copy_words(own, record_address(camera), _CAMERA_WORDS)
    return camera_at(own, 0)


@inlined
def light_sample_in(scratch):
    """The tile's LIGHT_SAMPLE."""
    return light_sample_at(scratch + SCRATCH_LIGHT_SAMPLE, 0)


@inlined
def path_in(scratch):
    """The tile's PATH."""
    return path_at(scratch + SCRATCH_PATH, 0)


@inlined
def point_in(scratch):
    """The SHADING_POINT of the tile's path, as it is."""
    return shading_point_at(scratch + SCRATCH_POINT, 0)


@inlined
def _with_room(point, closures, registers):
    point.closures = closures
    point.registers = registers
    return point


@inlined
def tile_point(scratch):
    """The SHADING_POINT of the tile's path, with room for its closures and registers."""
    return _with_room(point_in(scratch), scratch + SCRATCH_CLOSURES, scratch + SCRATCH_REGISTERS)


@inlined
def shadow_point_in(scratch):
    """The SHADING_POINT of shadows and of lights' programs, likewise."""
    point = shading_point_at(scratch + SCRATCH_SHADOW_POINT, 0)
    return _with_room(point, scratch + SCRATCH_SHADOW_CLOSURES, scratch + SCRATCH_SHADOW_REGISTERS)
