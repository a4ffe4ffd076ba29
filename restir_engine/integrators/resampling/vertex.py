"""The first vertex of a pixel's path, taken up again where the frame has kept it."""

from ...kernels.core.jit import inlined
from ...kernels.core.memory import copy_words, load_i64, record_address, store_i64
from ...kernels.core.records import CLOSURE, PATH, SCRATCH_CLOSURES, SHADING_POINT, path_at
from ...kernels.volume.calls import media_around
from .inputs import WORK_HELD, point_at

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


@inlined
def hold(scene, integrator, frame, scratch, path, sp, pixel):
    """`take_up` for who takes up the same vertex several times; whether it was still there, so that nothing is to do.

    The PATH is copied in any case. Who moves the SHADING_POINT on has to `let_go`.
    """
    kept = record_address(point_at(frame, pixel))
    held = load_i64(scratch + WORK_HELD, 0) == kept
    if held:
        copy_words(record_address(path), record_address(path_at(frame.paths, pixel)), _PATH_WORDS)
    else:
        take_up(scene, integrator, frame, scratch, path, sp, pixel)
        store_i64(scratch + WORK_HELD, 0, kept)
    return held


@inlined
def let_go(scratch):
    """No vertex is held in the tile's SHADING_POINT."""
    store_i64(scratch + WORK_HELD, 0, 0)
