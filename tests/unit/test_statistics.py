"""The sequential test: its false alarms and misses stay below what it states, and it stops early. Errors of means."""

import numpy as np
import pytest

from testing.statistics import Sequential, Verdict, controlled_mean, normal_scores, relative_difference

GROUP, LOOKS, TRIALS = 8, 4, 1200
SPREAD = 0.01 * np.sqrt(GROUP)  # of one value: the error of a group's mean is the bound


def rates(test: Sequential, off: float, channels: int = 1) -> tuple[dict[Verdict, float], float]:
    """(frequencies of the verdicts, mean number of looks) for means that differ by `off`, all channels alike."""
    counts, looks = dict.fromkeys(Verdict, 0), 0
    random = np.random.default_rng(7)
    reference = 1.0 + np.outer([1e-9, -1e-9], np.ones(channels))
    for _ in range(TRIALS):
        values = random.normal(1.0 + off, SPREAD / 4, (GROUP * LOOKS, channels))
        parts = [values[: GROUP * (k + 1)] for k in range(LOOKS)]
        seen = []
        verdict, _ = test.told(parts, lambda x, seen=seen: seen.append(x) or relative_difference(x, reference))
        counts[verdict] += 1
        looks += len(seen)
    return {verdict: count / TRIALS for verdict, count in counts.items()}, looks / TRIALS


def at_most(found: float, stated: float) -> bool:
    """Within three standard errors of a frequency."""
    return found <= stated + 3.0 * np.sqrt(stated * (1.0 - stated) / TRIALS)


@pytest.mark.parametrize("channels", [1, 4])
def test_equal_means_raise_few_false_alarms_and_are_told_early(channels):
    test = Sequential(bound=0.01, false_alarm=0.02, miss=0.02)
    found, looks = rates(test, 0.0, channels)
    assert at_most(found[Verdict.DIFFERENT], 0.02)
    assert found[Verdict.SAME] > 0.95 and looks < 2.5


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_difference_of_the_bound_is_rarely_missed(sign):
    test = Sequential(bound=0.01, false_alarm=0.02, miss=0.02)
    found, looks = rates(test, sign * 0.01)
    assert at_most(found[Verdict.SAME], 0.02)
    assert found[Verdict.DIFFERENT] > 0.95 and looks < 3.0


def test_what_is_tolerated_is_no_difference():
    """At the tolerance false alarms are as stated; where it is also the bound, both errors are."""
    test = Sequential(bound=0.01, tolerance=0.01, false_alarm=0.02, miss=0.02)
    found, _ = rates(test, 0.01)
    assert at_most(found[Verdict.DIFFERENT], 0.02) and at_most(found[Verdict.SAME], 0.02)
    assert rates(test, 0.0)[0][Verdict.SAME] > 0.99
    assert rates(test, 0.02)[0][Verdict.DIFFERENT] > 0.95


def test_few_values_are_not_trusted_beyond_their_number():
    """With an error that three values estimate, normal quantiles would raise twenty times the alarms."""
    test = Sequential(bound=1.0, false_alarm=0.01, looks=1)
    values = np.random.default_rng(1).normal(1.0, 0.01, (6000, 3))
    error = values.std(1, ddof=1) / np.sqrt(3)
    verdicts = [test.look(off, e, 2.0) for off, e in zip(values.mean(1) - 1.0, error, strict=True)]
    normal = [test.look(off, e) for off, e in zip(values.mean(1) - 1.0, error, strict=True)]
    alarms, naive = (np.mean([v is Verdict.DIFFERENT for v in found]) for found in (verdicts, normal))
    assert alarms < 0.014 and naive > 0.08


def test_welch():
    """Against the formulas by hand; a value that is not a number is a difference."""
    a, b = np.array([1.0, 1.2, 1.4]), np.array([2.0, 2.0, 2.3, 2.1])
    off, error, freedom = relative_difference(a, b)
    u, v = a.var(ddof=1) / 3, b.var(ddof=1) / 4
    assert off == pytest.approx(1.2 / 2.1 - 1.0) and error == pytest.approx(np.sqrt(u + v) / 2.1)
    assert freedom == pytest.approx((u + v) ** 2 / (u**2 / 2 + v**2 / 3))
    assert Sequential(bound=0.1).look(np.nan, 0.1) is Verdict.DIFFERENT


def test_scores_of_few_values_are_normal():
    random = np.random.default_rng(3)
    z = normal_scores(random.normal(1.0, 0.1, (4, 20_000)), random.normal(1.0, 0.2, (6, 20_000)))
    assert z.mean() == pytest.approx(np.sqrt(2 / np.pi), abs=0.02)
    assert (z > 2.0).mean() == pytest.approx(0.0455, abs=0.006) and (z > 3.0).mean() < 0.005


def test_controls_take_their_noise_out_of_a_mean_and_the_error_says_so():
    random = np.random.default_rng(5)
    found = []
    for _ in range(400):
        controls = random.normal(0.0, 1.0, (40, 2))
        values = 3.0 + controls @ [2.0, -0.5] + random.normal(0.0, 0.1, 40)
        mean, error, coefficients = controlled_mean(values, controls)
        assert np.abs(coefficients - [2.0, -0.5]).max() < 0.1
        found.append([mean, error])
    means, errors = np.transpose(found)
    assert abs(means.mean() - 3.0) < 4.0 * 0.1 / np.sqrt(40 * 400)
    assert abs(errors.mean() / means.std() - 1.0) < 4.0 / np.sqrt(2 * 400)
