"""The albedo A of a half space without a boundary under diffuse light, from its medium, and back.

van de Hulst's fit (1980, "Multiple Light Scattering", 14.5), inverted as in Kulla and Conty 2017, "Revisiting
Physically Based Shading at Imageworks". Both go by s = √(1 - α*), α* the albedo of the similar isotropic medium. Plain
Python, which kernels compile: `presets` needs no compiler.
"""

import math


def half_space_albedo(s):
    """A of s."""
    return (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)


def similarity(albedo):
    """s of A in [0, 1]."""
    return 4.09712 + 4.20863 * albedo - math.sqrt(9.59217 + 41.6808 * albedo + 17.7126 * albedo * albedo)


def scattering_albedo(albedo, g=0.0):
    """α of the medium of anisotropy g whose half space has the albedo A."""
    s = similarity(albedo)
    return (1.0 - s * s) / (1.0 - g * s * s)
