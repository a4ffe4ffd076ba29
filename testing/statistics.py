"""Tests of means that stop as soon as they can tell, with error rates that are stated and hold."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student


class Verdict(Enum):
    """What a look at the data tells."""

    SAME = "same"
    DIFFERENT = "different"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Sequential:
    """A group-sequential test whether two means are the same or differ by `bound` or more.

    It looks at the data at most `looks` times, each time with more of them, and ends with SAME when the data exclude
    a difference of ±bound, with DIFFERENT when they exclude all differences within ±tolerance. Each look spends an
    equal share of both error rates. By the union bound they hold whatever the looks have in common:

        P(DIFFERENT) ≤ false_alarm where the means differ by at most `tolerance`,
        P(SAME) ≤ miss where they differ by `bound` or more.

    A difference over its standard error is taken to have Student's distribution. Several numbers can be tested at once,
    such as channels: they share `false_alarm`, and are SAME only when all are; `miss` is that of each.
    """

    bound: float
    tolerance: float = 0.0
    false_alarm: float = 0.001
    miss: float = 0.01
    looks: int = 4

    def look(self, difference, error, freedom=np.inf) -> Verdict:
        """The verdict on differences with standard errors of so many degrees of freedom; numbers or arrays."""
        difference, error, freedom = (np.atleast_1d(np.asarray(x, float)) for x in (difference, error, freedom))
        if not (np.isfinite(difference).all() and np.isfinite(error).all()):
            return Verdict.DIFFERENT
        size = np.abs(difference)
        alarm = student.isf(self.false_alarm / (2 * self.looks * difference.size), freedom)
        if (size - alarm * error > self.tolerance).any():
            return Verdict.DIFFERENT
        # Of a difference of +bound the data exclude one side alone: that they are not below it.
        if (size + student.isf(self.miss / self.looks, freedom) * error < self.bound).all():
            return Verdict.SAME
        return Verdict.UNDECIDED

    def told(self, data: Iterable, measure: Callable) -> tuple[Verdict, tuple]:
        """Look at the items of `data`, each with all that came before, until one tells.

        measure(item) → (difference, error, freedom). Returns the verdict and what was measured last.
        """
        verdict, measured = Verdict.UNDECIDED, ()
        for number, item in enumerate(data):
            assert number < self.looks, "more looks than error was set aside for"
            measured = measure(item)
            verdict = self.look(*measured)
            if verdict is not Verdict.UNDECIDED:
                break
        return verdict, measured


def welch(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of independent values (n, …) and (m, …): (difference of the means, its standard error, degrees of freedom).

    The error is Welch's, for groups of unlike variance, and the degrees of freedom are Satterthwaite's.
    """
    (x, u), (y, v) = ((s.mean(0, dtype=float), s.var(0, ddof=1, dtype=float) / len(s)) for s in (a, b))
    total = np.maximum(u + v, 1e-300)
    freedom = total**2 / np.maximum(u**2 / (len(a) - 1) + v**2 / (len(b) - 1), 1e-300)
    return x - y, np.sqrt(u + v), np.maximum(freedom, 1.0)


def relative_difference(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`welch` of two groups, difference and error by the mean of b."""
    difference, error, freedom = welch(a, b)
    scale = np.abs(b.mean(0, dtype=float))
    return difference / scale, error / scale, freedom


def controlled_mean(values: np.ndarray, controls: np.ndarray) -> tuple[float, float, np.ndarray]:
    """The mean of values (n,) beside controls (n, k) of the mean 0: (mean, its standard error, k coefficients).

    Control variates: what a regression on the controls explains of the values is no noise of their mean.
    """
    n, k = controls.shape
    design = np.column_stack([np.ones(n), controls])
    coefficients = np.linalg.lstsq(design, values, rcond=None)[0]
    variance = np.square(values - design @ coefficients).sum() / (n - 1 - k)
    return coefficients[0], np.sqrt(variance * np.linalg.inv(design.T @ design)[0, 0]), coefficients[1:]


def normal_scores(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Absolute differences of two means in standard errors, as if these were known well.

    Few values say little about their own spread: |t| is replaced by the normal deviate that is as unlikely.
    """
    difference, error, freedom = welch(a, b)
    floor = 1e-6 * np.abs(b.mean(0, dtype=float)) + 1e-12  # float32 is no finer
    tail = student.sf(np.abs(difference) / np.maximum(error, floor), freedom)
    return norm.isf(np.maximum(tail, 1e-300))
