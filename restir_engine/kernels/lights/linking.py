"""Light linking: which lights reach what, and what blocks them.

Each instance belongs to one light set (0 to 63; 0 is what no light knows of), each lamp and each emitting instance has
a bit for each set that it lights. What a medium scatters is lit by the lights that reach set 0, the camera sees all,
and the world lights everything.

Each instance also belongs to one set of blockers (0 to 7), which is in its mask for Embree; a light has a bit for each
set that blocks it. Rays of the BSDF are blocked by all, so that such light is found by light sampling alone, and by
rays where that is not asked: the camera's, and those of mirrors.
"""

from ..core.jit import inlined
from ..core.records import BLOCKERS_OPAQUE, BLOCKERS_TRANSPARENT, RAY_SHADOW_OPAQUE, RAY_SHADOW_TRANSPARENT

SEES_ALL = -1  # the light set of a ray that comes from the camera
EVERYTHING = -1  # the bits of all sets


@inlined
def reaches(links, light_set):
    """Whether a light with these bits lights what belongs to a set."""
    return light_set < 0 or (links >> light_set) & 1 != 0


@inlined
def opaque_blockers(blockers):
    """The mask of rays towards a light that only what lets no light through shall stop."""
    return (RAY_SHADOW_OPAQUE if blockers & 1 else 0) | (blockers << 15 & BLOCKERS_OPAQUE)


@inlined
def transparent_blockers(blockers):
    """The same for all else."""
    return (RAY_SHADOW_TRANSPARENT if blockers & 1 else 0) | (blockers << 22 & BLOCKERS_TRANSPARENT)
