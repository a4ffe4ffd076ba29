"""The Sky Texture node."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...kernels.shading.textures import opcodes as ops
from ...kernels.shading.textures import sky as kinds
from ...scene import sky, sky_multiple
from .coordinates import texture_vector
from .registry import node


@lru_cache(maxsize=4)
def _half(atmosphere: sky.Atmosphere) -> np.ndarray:
    return sky.half_dome(atmosphere)


@lru_cache(maxsize=4)
def _full(atmosphere: sky.Atmosphere, multiple: bool) -> np.ndarray:
    return sky_multiple.multiple_dome(atmosphere) if multiple else sky.full_dome(atmosphere)


def _atmosphere(node) -> sky.Atmosphere:
    aerosols = node.aerosol_density if hasattr(node, "aerosol_density") else node.dust_density
    return sky.Atmosphere(
        elevation=node.sun_elevation,
        rotation=node.sun_rotation,
        size=max(node.sun_size, 1e-4),
        intensity=node.sun_intensity,
        disc=node.sun_disc,
        altitude=node.altitude,
        air=node.air_density,
        aerosols=aerosols,
        ozone=node.ozone_density,
    ).normalized()


def _dome(atmosphere: sky.Atmosphere, sky_type: str) -> tuple[np.ndarray, np.ndarray]:
    """Pixels and parameters of a computed atmosphere."""
    # What the disc alone depends on, and the turn around the zenith, need no new table.
    shape = sky.replace(atmosphere, rotation=0.0, size=0.0, intensity=0.0, disc=False)
    if sky_type == "NISHITA":
        return _half(shape), sky.dome_parameters(atmosphere, sky.single_sun(atmosphere, False))
    if sky_type == "MULTIPLE_SCATTERING":
        return _full(shape, True), sky.dome_parameters(atmosphere, sky_multiple.multiple_sun(atmosphere))
    return _full(shape, False), sky.dome_parameters(atmosphere, sky.single_sun(atmosphere, True))


# Irradiance of the ground under Cycles' Hosek/Wilkie sky relative to Preetham's: 0.09 to 0.20, by turbidity and sun.
HOSEK_BRIGHTNESS = 0.14


@node("ShaderNodeTexSky")
def sky_texture(c, node):
    out = c.allocate(3)
    vector = texture_vector(c, node)
    if node.sky_type in ("PREETHAM", "HOSEK_WILKIE"):
        brightness = 1.0
        if node.sky_type == "HOSEK_WILKIE":
            c.warn("Hosek/Wilkie is rendered as Preetham's sky of the same turbidity")
            brightness = HOSEK_BRIGHTNESS
        table = c.table(sky.preetham(tuple(node.sun_direction), node.turbidity, brightness))
        c.emit(ops.SKY, out, vector, -1, table, kinds.PERCEPTUAL)
        return {"Color": c.of_rec709(out)}
    atmosphere = _atmosphere(node)
    pixels, parameters = _dome(atmosphere, node.sky_type)
    # By node, so that a sun that is dragged about replaces its sky.
    index = c.scene.images.add(("sky", c.kind, c.name, node.id_data.name, node.name), pixels)
    kind = kinds.HALF_DOME if node.sky_type == "NISHITA" else kinds.FULL_DOME
    c.emit(ops.SKY, out, vector, index, c.table(parameters), kind)
    return {"Color": c.of_rec709(out)}
