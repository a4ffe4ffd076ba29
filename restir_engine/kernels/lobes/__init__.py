"""The BSDFs: closures that shader programs make, and what the integrators ask of them."""

from .nodes import BSDF_NODES

__all__ = ["BSDF_NODES"]
