"""Media that contain a point, and a shadow ray through them."""

from ..memory import record_at
from .layout import record

MAX_MEDIA = 8
MAX_PHASES = 6
PHASE = 5  # float64 words of a phase function: kind (PHASE_* of kernels.volume.phase), weight, three parameters

WALK = record(  # of a ray through the cells of MAJORANTS, from one tentative collision to the next
    ("planes", 3),  # where it leaves its cell along each axis, and how far apart planes are: see volume.majorants
    ("steps", 3),
    ("t", 1),
    ("last", 1),  # where it leaves the cells
    ("end", 1),
    "i",
    "j",
    "k",
)
walk_at = record_at(WALK)

MEDIUM = record(
    "instance",  # -1: the world
    "material",
    "priority",
    "n_phases",
    "majorants",  # MAJORANTS of a medium that varies in space; 0: it is the same everywhere
    ("sigma_t", 3),  # extinction and scattering, 1 by scene unit; of a medium that varies, at the point last asked for
    ("sigma_s", 3),
    ("emission", 3),  # radiance by scene unit
    ("next", 1),  # where on a ray its next tentative collision lies, and the majorant there
    ("mu", 1),
    ("phases", MAX_PHASES * PHASE),
    ("walk", WALK.itemsize // 8),
)
medium_at = record_at(MEDIUM)

MEDIA = record(  # followed by MEDIUM [MAX_MEDIA]
    "count",
    "top",  # highest priority of the media; those that have it add up:
    "varying",  # how many of these vary in space
    "chosen",  # the one that varies and has scattered, -1: those that do not vary
    ("sigma_t", 3),  # sums over those that do not vary
    ("sigma_s", 3),
    ("emission", 3),
    ("next", 1),  # as in MEDIUM, of their sum
    ("mu", 1),
    ("pivot", 4),  # of the segment, see kernels.volume.pivot: Δ, D (0: there is none), θ_a, θ_b
    ("target", 3),  # the direction of a lamp that paths are led towards, and their share: see volume.towards_lamps
    ("share", 1),
    ("density", 1),  # by distance, of the point where a path has scattered in media of which some vary
)
media_at = record_at(MEDIA)

SHADOW = record(  # a shadow ray through media
    ("o", 3),
    ("d", 3),
    ("tmax", 1),
    ("transmittance", 3),
    ("begin", 1),  # a part of the ray, for media that vary
    ("end", 1),
)
shadow_at = record_at(SHADOW)

MAJORANTS = record(  # bounds of the extinction of a medium that varies, by cells of a box
    ("to_grid", 12),  # from world space to cells: cell (i, j, k) is what floors to that
    "nx",
    "ny",
    "nz",
    "scatters",  # 1: in some place
    "emits",
    # By cells, in units: what bounds the extinction, uint16 [nx, ny, nz]; uint32 likewise, in the low half a bound of
    # its difference to a mean, in the high half that mean, of the colour `color`. Outside of them is no medium.
    "bounds",
    "means",
    ("bound_unit", 1),  # 1 by scene unit
    ("residual_unit", 1),
    ("mean_unit", 1),
    ("color", 3),
    # Of a medium whose coefficients are those of one grid's value 1 times the value, which needs no program:
    "voxels",  # VOXELS of that grid, whose index is `size` times the place among the cells; 0: it is no such medium
    "size",
    ("sigma_t", 3),
    ("sigma_s", 3),
    "n_phases",
    ("phases", MAX_PHASES * PHASE),
)
majorants_at = record_at(MAJORANTS)

VOXELS = record(  # a grid of values, interpolated linearly; 0 outside
    ("to_index", 12),  # from object space to indices: the value [i, j, k] is that at (i, j, k)
    "nx",
    "ny",
    "nz",
    "components",
    "values",  # float32 [nx, ny, nz, components]
)
voxels_at = record_at(VOXELS)
