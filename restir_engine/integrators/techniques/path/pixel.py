"""What the shift asks of the paths of two pixels before all else."""

from ....kernels.core.jit import inlined
from ....kernels.core.records import path_at


@inlined
def same_state(a, pixel, b, other):
    """Whether the paths of two pixels (of the frames a and b) count the same bounces at their vertices."""
    p, q = path_at(a.paths, pixel), path_at(b.paths, other)
    return (
        p.flags == q.flags
        and p.bounce == q.bounce
        and p.diffuse_bounce == q.diffuse_bounce
        and p.glossy_bounce == q.glossy_bounce
        and p.transmission_bounce == q.transmission_bounce
        and p.transparent_bounce == q.transparent_bounce
        and p.min_pdf == q.min_pdf
    )
