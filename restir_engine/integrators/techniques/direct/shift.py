"""The shift of direct light: the point of the light is kept, whoever is lit by it.

The coordinates of a sample do not depend on the domain, and the integrand contains the geometry term; so the shift is
the identity and its Jacobian is 1. From one frame to another the light is found again by its key.
"""

from ....kernels.core.jit import entry, inlined
from ....kernels.core.records import POINT_ON_LAMP, POINT_ON_WORLD
from ...resampling.frame import frame_at
from ...resampling.motion import look_up, motion_at
from ...resampling.options import SHADED, TARGET, reuse_at
from ...resampling.technique import NOW, domain_at, shifted_at
from .sample import direct_reservoir_at, forget


@entry
def shift_light(start, to, reservoir, shifted, unused):
    """T(x) of a point of a light from one pixel, of either frame, to another (see resampling.technique)."""
    a, b = domain_at(start, 0), domain_at(to, 0)
    r = direct_reservoir_at(shifted, 0)
    if a.when != b.when:
        motion = motion_at(a.motion, 0)
        source, primitive = int(r.source), int(r.primitive)
        there = source_now(motion, source, primitive) if b.when == NOW else source_before(motion, source, primitive)
        if there < 0:
            return  # the light is not there: the shift fails
        r.source = there
    if not _keeps_visibility(a, b):
        forget(r)
    shifted_at(shifted, 0).jacobian = 1.0


@inlined
def _keeps_visibility(a, b):
    """Whether V̄ goes with the sample: with what has stayed in its pixel, or where pixels are near by `reuse.near`."""
    reuse = reuse_at(a.reuse, 0)
    if reuse.visibility == TARGET or reuse.visibility == SHADED:
        return False
    if a.frame != b.frame:
        return True
    width = frame_at(a.frame, 0).width
    dx = b.pixel % width - a.pixel % width
    dy = b.pixel // width - a.pixel // width
    return dx * dx + dy * dy < reuse.near * reuse.near


@inlined
def source_before(motion, source, primitive):
    """The source of a light's point (kernels.lights.points) in the frame before; -1: that light was not there.

    The other coordinates stay: they are measured by shares of the light.
    """
    if primitive == POINT_ON_WORLD:
        return source
    return look_up(motion.lamp_before if primitive == POINT_ON_LAMP else motion.instance_before, source)


@inlined
def source_now(motion, source, primitive):
    """The source now of a light's point of the frame before; the inverse of `source_before`."""
    if primitive == POINT_ON_WORLD:
        return source
    return look_up(motion.lamp_after if primitive == POINT_ON_LAMP else motion.instance_after, source)
