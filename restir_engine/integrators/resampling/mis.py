"""MIS weights of resampling, on scalars; `resample` applies them to a table of candidates.

c_i is the confidence of candidate i, from_i = p̂_{←i}(y) the target of its domain carried to y (course, eq. 5.9): 0
where y cannot be shifted into that domain. The canonical candidate is the pixel's own: its domain is the one
resampled for, so that its from_i is `target` = p̂(y). Everything here is 0 where its denominator is.
"""

from ...kernels.core.jit import inlined

# BALANCE: m_i = c_i from_i / Σ_j c_j from_j (eq. 5.11). Needs from_j for every pair of candidates.
# PAIRWISE: each candidate against the canonical one alone (eq. 7.7). DEFENSIVE: with a share that the canonical one
# has in any case (eq. 7.8).
# CONTRIBUTION: selection by confidence, balance for the one selected (eq. 7.1, 7.2): unbiased, noisier.
# CONFIDENCE: m_i = c_i / Σ_j c_j, "1/M": biased, it darkens where the domains' supports differ; for comparison.
BALANCE, PAIRWISE, DEFENSIVE, CONTRIBUTION, CONFIDENCE = range(5)
MIS_KINDS = {
    "BALANCE": BALANCE,
    "PAIRWISE": PAIRWISE,
    "DEFENSIVE": DEFENSIVE,
    "CONTRIBUTION": CONTRIBUTION,
    "CONFIDENCE": CONFIDENCE,
}


@inlined
def balance(c_i, from_i, total):
    """Generalized balance heuristic; `total` = Σ_j c_j from_j."""
    return c_i * from_i / total if total > 0.0 else 0.0


@inlined
def by_confidence(c_i, total):
    """m_i = c_i / Σ_j c_j."""
    return c_i / total if total > 0.0 else 0.0


@inlined
def pairwise(c_i, from_i, c_c, target, others, scale):
    """m_i of a candidate that is not the canonical one.

    c_c, target: confidence and p̂(y) of the canonical one; others: S = Σ_{k≠c} c_k; scale: S, or the sum of all
    confidences for the defensive form.
    """
    pair = others * from_i + c_c * target
    return others * c_i * from_i / (scale * pair) if scale * pair > 0.0 else 0.0


@inlined
def pairwise_share(c_j, from_j, c_c, target, others, scale):
    """What the pair with candidate j adds to the canonical candidate's weight."""
    pair = others * from_j + c_c * target
    return c_j * c_c * target / (scale * pair) if scale * pair > 0.0 else 0.0


@inlined
def defence(c_c, scale):
    """The share that the defensive form leaves to the canonical candidate; `scale` = Σ_k c_k."""
    return c_c / scale if scale > 0.0 else 0.0
