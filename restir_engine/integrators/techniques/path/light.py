"""The last step of whole paths: what resampling has left lights the pixel."""

from ....kernels.core.jit import kernel
from ....kernels.core.memory import copy_words, record_address
from ....kernels.core.records import FILM, INTEGRATOR, PATH, path_at, path_in
from ....kernels.core.vec import mul, vec
from ....kernels.film.contribute import contribute, contribute_to_groups, lit_by_several, lit_indirectly
from ....kernels.lobes.classes import lobe_sum
from ...resampling.frame import FRAME
from ...resampling.inputs import light_by_group, load_indirect, load_light, point_at

_PATH_WORDS = PATH.itemsize // 8


@kernel
def light_tile(integrator: INTEGRATOR, film: FILM, frame: FRAME, scratch, x0, y0, x1, y1):
    """Contribute frame.light, and the part of it that is indirect as such; integrator: without clamps."""
    path = path_in(scratch)
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = y * frame.width + x
            if point_at(frame, pixel).instance < 0:
                continue
            copy_words(record_address(path), record_address(path_at(frame.paths, pixel)), _PATH_WORDS)
            throughput = vec(path.throughput)
            f = load_light(frame, pixel)
            contribute(integrator, film, path, mul(lobe_sum(f), throughput), lit_by_several(path, f))
            f = load_indirect(frame, pixel)
            contribute(integrator, film, path, mul(lobe_sum(f), throughput), lit_indirectly(path, f))
            if frame.light_groups != 0:
                contribute_to_groups(integrator, film, path, (0.0, 0.0, 0.0), light_by_group(frame, pixel))
