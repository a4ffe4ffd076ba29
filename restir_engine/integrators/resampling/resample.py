"""Generalized resampled importance sampling of a few candidates (course, ch. 5), whatever they are.

A technique shifts its samples and writes what came of it to a table in working memory, a row a candidate; row 0 is
the canonical one. What is here reads the table alone. A failed shift is a row of target 0: its confidence counts.

    put_candidate, put_from …  →  weigh  →  choose  →  (put_from of the chosen)  →  selected_weight

`weigh` needs from_j(y_i) as `needs_from` says: all for BALANCE; for PAIRWISE and DEFENSIVE those between the canonical
candidate and each other; none for CONTRIBUTION, which wants the chosen one's afterwards, and for CONFIDENCE.
"""

from ...kernels.core.jit import device, inlined
from ...kernels.core.memory import load_f64, store_f64
from .mis import (
    BALANCE,
    CONFIDENCE,
    CONTRIBUTION,
    DEFENSIVE,
    balance,
    by_confidence,
    defence,
    pairwise,
    pairwise_share,
)

MAX_CANDIDATES = 16
# Columns of a row, float64: confidence; contribution weight W |T'| of the shifted sample; its target p̂(y);
# resampling weight w = m p̂ W |T'|; from there on p̂_{←j}(y) for each candidate j.
_CONFIDENCE, _CONTRIBUTION_WEIGHT, _TARGET, _WEIGHT, _FROM = range(5)
_COLUMNS = _FROM + MAX_CANDIDATES
TABLE_BYTES = 8 * _COLUMNS * MAX_CANDIDATES


@inlined
def put_candidate(table, i, confidence, contribution_weight, target):
    """Row i: a shifted sample y with W |T'| and p̂(y). Its other columns are those of a sample alone in its domain."""
    row = _COLUMNS * i
    store_f64(table, row + _CONFIDENCE, confidence)
    store_f64(table, row + _CONTRIBUTION_WEIGHT, contribution_weight)
    store_f64(table, row + _TARGET, target)
    store_f64(table, row + _WEIGHT, 0.0)
    store_f64(table, row + _FROM, target)


@inlined
def put_from(table, i, j, value):
    """p̂_{←j}(y_i): p̂_j(x) / |T_j'(x)| for x = T_j⁻¹(y_i); 0 where y_i cannot be shifted to domain j."""
    store_f64(table, _COLUMNS * i + _FROM + j, value)


@inlined
def needs_from(kind, i, j):
    """Whether `weigh` reads p̂_{←j}(y_i); that of the canonical domain (j = 0) is the target."""
    if j == 0 or kind >= CONTRIBUTION:
        return False
    return kind == BALANCE or i == 0 or i == j


@inlined
def weight_of(table, i):
    """w_i, after `weigh`."""
    return load_f64(table, _COLUMNS * i + _WEIGHT)


@inlined
def contribution_weight_of(table, i):
    """W |T'| of candidate i where it counts: 0 where its target is."""
    row = _COLUMNS * i
    return load_f64(table, row + _CONTRIBUTION_WEIGHT) if load_f64(table, row + _TARGET) > 0.0 else 0.0


@inlined
def target_of(table, i):
    """p̂(y_i)."""
    return load_f64(table, _COLUMNS * i + _TARGET)


@device
def total_confidence(table, n):
    """Σ c_i."""
    total = 0.0
    for i in range(n):
        total += load_f64(table, _COLUMNS * i + _CONFIDENCE)
    return total


@device
def _balance_total(table, n, i):
    """Σ_j c_j p̂_{←j}(y_i)."""
    total = 0.0
    for j in range(n):
        total += load_f64(table, _COLUMNS * j + _CONFIDENCE) * load_f64(table, _COLUMNS * i + _FROM + j)
    return total


@device
def mis_weight(table, n, kind, i):
    """m_i(y_i)."""
    row = _COLUMNS * i
    c_i = load_f64(table, row + _CONFIDENCE)
    if kind == BALANCE:
        return balance(c_i, load_f64(table, row + _FROM + i), _balance_total(table, n, i))
    confidence = total_confidence(table, n)
    if kind >= CONTRIBUTION:
        return by_confidence(c_i, confidence)
    c_c = load_f64(table, _CONFIDENCE)
    others = confidence - c_c
    target = load_f64(table, row + _TARGET)
    scale = confidence if kind == DEFENSIVE else others
    if i > 0:
        return pairwise(c_i, load_f64(table, row + _FROM + i), c_c, target, others, scale)
    if others <= 0.0:
        return 1.0
    m = defence(c_c, scale) if kind == DEFENSIVE else 0.0
    for j in range(1, n):
        c_j = load_f64(table, _COLUMNS * j + _CONFIDENCE)
        m += pairwise_share(c_j, load_f64(table, _FROM + j), c_c, target, others, scale)
    return m


@device
def weigh(table, n, kind):
    """Fill in the weights w_i = m_i(y_i) p̂(y_i) W_i |T_i'| of n candidates; their sum."""
    total = 0.0
    for i in range(n):
        row = _COLUMNS * i
        weight = load_f64(table, row + _TARGET) * load_f64(table, row + _CONTRIBUTION_WEIGHT)
        if weight > 0.0:
            weight *= mis_weight(table, n, kind, i)
        else:
            weight = 0.0
        store_f64(table, row + _WEIGHT, weight)
        total += weight
    return total


@device
def choose(table, n, total, u):
    """A candidate in proportion to its weight; -1 when all are 0."""
    chosen = -1
    if total <= 0.0:
        return chosen
    left = u * total
    for i in range(n):
        weight = load_f64(table, _COLUMNS * i + _WEIGHT)
        if weight > 0.0:
            chosen = i
            left -= weight
            if left < 0.0:
                return chosen
    return chosen


@device
def selected_weight(table, n, kind, total, i):
    """W_Y of the chosen candidate: Σ_k w_k / p̂(y_i), times c_i(y_i) / m_i(y_i) for CONTRIBUTION (eq. 7.1)."""
    target = load_f64(table, _COLUMNS * i + _TARGET)
    w = total / target if target > 0.0 else 0.0
    if kind != CONTRIBUTION:
        return w
    c_i = load_f64(table, _COLUMNS * i + _CONFIDENCE)
    proper = balance(c_i, load_f64(table, _COLUMNS * i + _FROM + i), _balance_total(table, n, i))
    return w * proper / mis_weight(table, n, CONFIDENCE, i)
