"""Lights as kernels see them: sampling, intersection, emission and densities.

What `LIGHT.p` holds, by kind:

    point   nothing
    spot    0 cosine of half the cone, 1 steepness of the blend, 2 1 - cos of the widest half cone (a scaled
            lamp's is elliptic), 3–5 axis
    area    0–2 u axis, 3 width, 4–6 v axis, 7 height, 8–10 normal, 11 tangent of half the spread,
            12 the spread's normalisation, 0 without spread
    sun     0–2 direction to the sun, 3 1 - cos of half the angle

A lamp neither blocks nor deflects rays: one that hits a lamp goes on behind it.
"""

from .choice import note_choice
from .evaluate import drawn_pdf, light_radiance, lights_intersect, sun_next, world_pdf
from .points import light_point, point_of_lamp, point_of_sample, point_pdf_of
from .sample import light_is_sampled, light_sample, samples_tiles
from .triangle import triangle_pdf

__all__ = [
    "drawn_pdf",
    "light_is_sampled",
    "light_point",
    "light_radiance",
    "light_sample",
    "lights_intersect",
    "note_choice",
    "point_of_lamp",
    "point_of_sample",
    "point_pdf_of",
    "samples_tiles",
    "sun_next",
    "triangle_pdf",
    "world_pdf",
]
