"""Media that were measured: reduced scattering σ_s′ and absorption σ_a, and what they are in an artist's terms."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .kernels.subsurface.van_de_hulst import half_space_albedo

JENSEN = "Measured: Jensen, Marschner, Levoy and Hanrahan 2001, “A Practical Model for Subsurface Light Transport”"
OURS = "Ours, by eye"

RGB = tuple[float, float, float]


@dataclass(frozen=True)
class Medium:
    """σ_s′ and σ_a are in 1/mm, for red, green and blue. As it is known by σ_s′ alone, light scatters evenly: g = 0."""

    name: str
    scattering: RGB
    absorption: RGB
    source: str = JENSEN

    @property
    def color(self) -> RGB:
        """The albedo of a semi-infinite medium without a boundary, under diffuse light (scene linear)."""
        return tuple(surface_albedo(s / (s + a)) for s, a in zip(self.scattering, self.absorption, strict=True))

    @property
    def mean_free_path(self) -> RGB:
        """1/σ_t in metres."""
        return tuple(1e-3 / (s + a) for s, a in zip(self.scattering, self.absorption, strict=True))


def surface_albedo(albedo: float) -> float:
    """The colour of a thick piece of a medium with g = 0: what subsurface.parameters.kulla_conty_albedo inverts."""
    return half_space_albedo(math.sqrt(1.0 - albedo))


MEDIA: dict[str, Medium] = {
    "APPLE": Medium("Apple", (2.29, 2.39, 1.97), (0.0030, 0.0034, 0.046)),
    "CHICKEN_1": Medium("Chicken 1", (0.15, 0.21, 0.38), (0.015, 0.077, 0.19)),
    "CHICKEN_2": Medium("Chicken 2", (0.19, 0.25, 0.32), (0.018, 0.088, 0.20)),
    "CREAM": Medium("Cream", (7.38, 5.47, 3.15), (0.0002, 0.0028, 0.0163)),
    "KETCHUP": Medium("Ketchup", (0.18, 0.07, 0.03), (0.061, 0.97, 1.45)),
    "MARBLE": Medium("Marble", (2.19, 2.62, 3.00), (0.0021, 0.0041, 0.0071)),
    "MILK_SKIMMED": Medium("Milk, Skimmed", (0.70, 1.22, 1.90), (0.0014, 0.0025, 0.0142)),
    "MILK_WHOLE": Medium("Milk, Whole", (2.55, 3.21, 3.77), (0.0011, 0.0024, 0.014)),
    "POTATO": Medium("Potato", (0.68, 0.70, 0.55), (0.0024, 0.0090, 0.12)),
    "SKIN_1": Medium("Skin 1", (0.74, 0.88, 1.01), (0.032, 0.17, 0.48)),
    "SKIN_2": Medium("Skin 2", (1.09, 1.59, 1.79), (0.013, 0.070, 0.145)),
    "JADE": Medium("Jade", (0.60, 0.75, 0.65), (0.055, 0.009, 0.035), OURS),
    "WAX": Medium("Wax", (0.55, 0.60, 0.65), (0.0012, 0.0045, 0.025), OURS),
}
