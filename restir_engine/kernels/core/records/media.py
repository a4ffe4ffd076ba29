"""Media that contain a point, and a shadow ray through them."""

from ..memory import record_at
from .layout import record

MAX_MEDIA = 8
MAX_PHASES = 6
PHASE = 5  # float64 words of a phase function: kind (PHASE_* of kernels.volume.phase), weight, three parameters

MEDIUM = record(
    "instance",
    "material",
    "priority",
    "n_phases",
    ("sigma_t", 3),  # extinction and scattering, 1 by scene unit
    ("sigma_s", 3),
    ("emission", 3),  # radiance by scene unit
    ("phases", MAX_PHASES * PHASE),
)
medium_at = record_at(MEDIUM)

MEDIA = record(  # followed by MEDIUM [MAX_MEDIA]
    "count",
    "top",  # highest priority of the media; those that have it add up to:
    ("sigma_t", 3),
    ("sigma_s", 3),
    ("emission", 3),
)
media_at = record_at(MEDIA)

SHADOW = record(  # a shadow ray through media
    ("o", 3),
    ("d", 3),
    ("tmax", 1),
    ("transmittance", 3),
)
shadow_at = record_at(SHADOW)
