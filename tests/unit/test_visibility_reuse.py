"""Visibility that is carried along: its noise, and the signs and sizes of its biases (Tokuyoshi 2024).

A floor under a reddish and a bluish lamp, an opaque card between: shadows of both colours.
"""

import pytest

from testing.scenes.card import REUSES, always_known, bias, card, converged, pictures, structure


@pytest.fixture(scope="module")
def truth():
    return converged(card())


@pytest.fixture(scope="module")
def rendered():
    """Pictures and V by name of the reuse."""
    scene = card()
    return {name: pictures(scene, *reuse) for name, reuse in REUSES.items()}


def test_averaged_visibility_has_less_variance_at_the_same_rays(rendered):
    known = always_known(rendered["reused"][1])
    plain, estimated = (rendered[name][1][:, known].var(0, ddof=1).mean() for name in ("reused", "estimated"))
    assert known.mean() > 0.5 and estimated < 0.7 * plain


def test_the_averaged_visibility_lessens_noise_of_the_picture(rendered):
    plain, estimated = (rendered[name][0].var(0, ddof=1).mean() for name in ("reused", "estimated"))
    assert estimated < plain


def test_discarding_what_is_in_shadow_darkens(rendered, truth):
    for name in ("discard", "discard, estimated"):
        off, error = bias(rendered[name][0], truth)
        assert off < -5.0 * error and off < -0.01


def test_colours_leak_and_not_by_channel(rendered, truth):
    leak = structure(rendered["estimated"][0], truth)
    assert leak > 3.0 * structure(rendered["reused"][0], truth)
    assert structure(rendered["by channel"][0], truth) < 0.4 * leak


def test_leaking_shifts_the_mean_less_than_discarding(rendered, truth):
    leak, dark = (bias(rendered[name][0], truth)[0] for name in ("estimated", "discard"))
    assert abs(leak) < 0.25 * abs(dark)
