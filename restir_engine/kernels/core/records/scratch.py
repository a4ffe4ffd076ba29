"""Working memory of one tile call: one block, owned by the session, 64-byte aligned. Areas are offsets in it."""

from .lights import LIGHT_SAMPLE
from .media import MAX_MEDIA, MEDIA, MEDIUM, SHADOW
from .render import PATH
from .shading import CLOSURE, MAX_CLOSURES, MAX_REGISTERS, SHADING_POINT

_RAY_BYTES = 96  # RTCRayHit
_MEDIA_BYTES = MEDIA.itemsize + MAX_MEDIA * MEDIUM.itemsize
_CLOSURE_BYTES = MAX_CLOSURES * CLOSURE.itemsize
_REGISTER_BYTES = 8 * MAX_REGISTERS
_SHARED_BYTES = 32768


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
SCRATCH_BYTES = _behind(SCRATCH_TILE_WEIGHTS, 1024)


def shared_area(n_bytes: int) -> int:
    """The area that stages use by turns, for one that needs `n_bytes`: nothing in it outlives the stage.

    Those that use it: hits of subsurface scattering, candidates and reuse of resampling.
    """
    if n_bytes > _SHARED_BYTES:
        raise ValueError(f"the shared area has {_SHARED_BYTES} bytes, {n_bytes} are needed")
    return _SHARED
