"""The first vertex of a pixel's path, taken up again where the frame has kept it."""

from ...kernels.core.jit import inlined
from ...kernels.core.memory import copy_words, record_address
from ...kernels.core.records import CLOSURE, PATH, SCRATCH_CLOSURES, SHADING_POINT, path_at
from ...kernels.volume.calls import media_around
from .inputs import point_at

_CLOSURE_WORDS, _POINT_WORDS, _PATH_WORDS = (dtype.itemsize // 8 for dtype in (CLOSURE, SHADING_POINT, PATH))


@inlined
def take_up(scene, integrator, frame, scratch, path, sp, pixel):
    """Put the pixel's path and its vertex, with closures, into the tile's PATH and SHADING_POINT."""
    kept = point_at(frame, pixel)
    copy_words(record_address(path), record_address(path_at(frame.paths, pixel)), _PATH_WORDS)
    registers = sp.registers
    copy_words(scratch + SCRATCH_CLOSURES, kept.closures, _CLOSURE_WORDS * kept.n_closures)
    copy_words(record_address(sp), record_address(kept), _POINT_WORDS)
    sp.closures = scratch + SCRATCH_CLOSURES
    sp.registers = registers
    media_around(scene, integrator, scratch, path, sp)
