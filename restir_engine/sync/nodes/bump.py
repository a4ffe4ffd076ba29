"""Nodes that bend the shading normal."""

from __future__ import annotations


def displaced_normal(c, output) -> int:
    """The shading normal that a material output's displacement stands for."""
    return c.vector(output, "Displacement")
