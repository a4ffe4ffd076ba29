"""The BSDFs: closures that shader programs make, and what the integrators ask of them."""

from .dispatch import bsdf_eval, bsdf_sample, glass_eval, label_pdf
from .nodes import BSDF_NODES
from .passes import (
    bsdf_blur,
    bsdf_color,
    bsdf_has_eval,
    bsdf_normal,
    bsdf_roughness,
    denoise_features,
    graded_features,
    is_blurred,
)
from .tables import lobe_tables

__all__ = [
    "BSDF_NODES",
    "bsdf_blur",
    "bsdf_color",
    "bsdf_eval",
    "bsdf_has_eval",
    "bsdf_normal",
    "bsdf_roughness",
    "bsdf_sample",
    "denoise_features",
    "glass_eval",
    "graded_features",
    "is_blurred",
    "label_pdf",
    "lobe_tables",
]
