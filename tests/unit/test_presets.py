"""Presets: measured media in an artist's terms, and back."""

import numpy as np
import pytest

from restir_engine.kernels.core.jit import kernel
from restir_engine.kernels.subsurface.parameters import kulla_conty_albedo
from restir_engine.presets import JENSEN, MEDIA


@kernel
def _albedo(r, g, b):
    return kulla_conty_albedo((r, g, b), 0.0)


@pytest.mark.parametrize("key", MEDIA)
def test_a_medium_comes_back_from_the_artists_terms(key):
    medium = MEDIA[key]
    scattering, absorption = np.array(medium.scattering), np.array(medium.absorption)
    albedo, sigma_t = np.array(_albedo(*medium.color)), 1e-3 / np.array(medium.mean_free_path)
    assert albedo == pytest.approx(scattering / (scattering + absorption), abs=1e-5)
    assert albedo * sigma_t == pytest.approx(scattering, rel=1e-3)


def test_presets_are_distinct_and_say_where_they_come_from():
    assert len({medium.name for medium in MEDIA.values()}) == len(MEDIA)
    assert {key for key, medium in MEDIA.items() if medium.source != JENSEN} == {"JADE", "WAX"}


def test_colours_are_what_one_expects():
    jade, ketchup, marble = MEDIA["JADE"].color, MEDIA["KETCHUP"].color, MEDIA["MARBLE"].color
    assert jade[1] > max(jade[0], jade[2]) and ketchup[0] > 3.0 * ketchup[1] and min(marble) > 0.7
