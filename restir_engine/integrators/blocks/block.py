"""A block of pixels in working memory: the domains below their surfaces, and what has been found for them.

A domain is a point x₁ that is seen with all that S(x₁, ·) depends on. It has a lane in rows of float32, one a quantity:
the arithmetic over all of them is vector code. A sample is an exit x₂ with the light that enters there.
"""

import math

import numpy as np

from ...kernels.core.jit import device, inlined
from ...kernels.core.memory import copy_words, load_f32, record_address, record_at, store_f32
from ...kernels.core.records import PATH, path_at
from ...kernels.core.vec import max3, put, sub, vec
from ...kernels.subsurface.bssrdf import CYCLES, MULTIPLE_OF_SLAB, WHOLE
from ...kernels.subsurface.cycles_burley import CYCLES_F, CYCLES_REACH, NEAREST
from ...kernels.subsurface.probe import probe_frame
from ...kernels.subsurface.profile import REACH
from ...settings import MOST_LIGHT_GROUPS

SIDE = 16  # pixels, of the largest block
LANES = SIDE * SIDE

# Rows. x₁ counts from the block's origin; PROBES: how many are made from x₁, in the mean; UNIT: what makes a density of
# S; KEY: alike where domains may share; SIDED: 1 where S knows of a far side.
PLACE, NORMAL, REACHES, BEND, THICKNESS, SIDED, KEY, PROBES, UNIT = 0, 3, 6, 9, 12, 13, 14, 15, 16
# Of Cycles' kernel: a tangent, 1 where it is that, and the least distance from an axis.
TANGENT, CYCLIC, AXIS = 17, 20, 21
# S is a sum of terms A (e + e³) / r with e = e^(K r): R and R₁ on the near side of a slab, both again on its far one.
# Cycles' kernel has no such sum; the last two stand for its profile, with the factor 1 / (8 π d) and with its own.
TERMS = 4
UNIT_TERM, CYCLES_TERM = 2, 3
FACTORS, RATES = 22, 22 + 3 * TERMS
# Of a sample, in each domain: S by channel, the density that is made of it; r, and 1 / r times the side's share, near
# and far; how far the surface curves away.
_WORK = RATES + 3 * TERMS
SHAPE, DENSITY, NEAR, NEAR_SHARE, FAR, FAR_SHARE, TURN = (_WORK + k for k in (0, 3, 4, 5, 6, 7, 8))
LIGHT = _WORK + 9  # what the domains get of what belongs to no light group; then by light group

SAMPLE = np.dtype(
    [
        ("p", np.float32, (3,)),  # from the block's origin
        ("n", np.float32, (3,)),
        ("irradiance", np.float32, (3,)),  # rgb, by the density of being found
        ("lane", np.int32),  # of who has found it
        ("group", np.int32),
    ]
)
sample_at = record_at(SAMPLE)
MOST_LIT = 2  # exits of a probe that are lit, in the mean where there are more

BLOCK = np.dtype(
    [
        ("domains", np.int64),
        ("samples", np.int64),
        ("terms", np.int64),  # that S has in any of them
        ("has_cycles", np.int64),
        ("groups", np.int64),
        ("origin", np.float64, (3,)),
        ("keys", np.int32, (LANES,)),
        ("objects", np.int32, (LANES,)),  # 2 instance + 1 where the mesh takes the outside for its inside
    ]
)
block_at = record_at(BLOCK)
_PATHS = BLOCK.itemsize + -BLOCK.itemsize % 64
_SAMPLES = _PATHS + LANES * PATH.itemsize
_GROUPS = _SAMPLES + LANES * (MOST_LIT + 1) * SAMPLE.itemsize
_ROWS = _GROUPS + 12 * MOST_LIGHT_GROUPS
_ROWS += -_ROWS % 64
_PATH_WORDS = PATH.itemsize // 8
_AREA = 1.0 / (8.0 * math.pi)


def block_bytes(groups: int) -> int:
    """Working memory of a block for so many light groups; zeros but for BLOCK.groups."""
    return _ROWS + 4 * LANES * (LIGHT + 3 + 3 * groups)


@inlined
def begin_block(block):
    """Let a block be empty."""
    b = block_at(block, 0)
    b.domains = 0
    b.samples = 0
    b.terms = 0
    b.has_cycles = 0


@inlined
def path_of(block, lane):
    """The PATH of a domain as it has arrived there."""
    return path_at(block + _PATHS, lane)


@inlined
def sample_of(block, k):
    """A SAMPLE."""
    return sample_at(block + _SAMPLES, k)


@inlined
def groups_of(block):
    """The address of float32 [groups, 3] for a domain at a time."""
    return block + _GROUPS


@inlined
def light_of(block, lane, k):
    """What a domain gets, rgb: of no light group (0), or of one (1 + its number)."""
    row = LANES * (LIGHT + 3 * k) + lane
    rows = block + _ROWS
    return (load_f32(rows, row), load_f32(rows, row + LANES), load_f32(rows, row + 2 * LANES))


@inlined
def rows_of(block):
    """The address of the rows."""
    return block + _ROWS


@inlined
def _set(block, row, lane, value):
    store_f32(block + _ROWS, LANES * row + lane, value)


@inlined
def _set3(block, row, lane, value):
    for k in range(3):
        _set(block, row + k, lane, value[k])


@device
def _key_of(block, lane, path):
    """The first lane with which this one may share: the same object, and paths to which lights send the same."""
    b = block_at(block, 0)
    for k in range(lane - 1, -1, -1):
        if b.objects[k] == b.objects[lane]:
            p = path_of(block, k)
            if p.bounce == path.bounce and p.flags == path.flags and p.caught == path.caught:
                return int(b.keys[k])
    return lane


@device
def _put_term(block, lane, term, channel, weight, d):
    """Set a term of S: weight times the unit profile of scale d."""
    there = weight != 0.0 and 0.0 < d < math.inf
    _set(block, FACTORS + 3 * term + channel, lane, weight * _AREA / d if there else 0.0)
    _set(block, RATES + 3 * term + channel, lane, -1.0 / (3.0 * d) if there else -1.0)


@device
def put_domain(block, path, bssrdf, probes):
    """Add the domain of a BSSRDF, from which `probes` are made in the mean; its lane."""
    b = block_at(block, 0)
    lane = b.domains
    b.domains += 1
    if lane == 0:
        put(b.origin, vec(bssrdf.p))
    copy_words(record_address(path_of(block, lane)), record_address(path), _PATH_WORDS)
    b.objects[lane] = 2 * bssrdf.instance + (1 if bssrdf.side < 0.0 else 0)
    b.keys[lane] = _key_of(block, lane, path)
    _set(block, KEY, lane, float(b.keys[lane]))
    _set3(block, PLACE, lane, sub(vec(bssrdf.p), vec(b.origin)))
    _set3(block, NORMAL, lane, vec(bssrdf.n))
    _set(block, THICKNESS, lane, float(bssrdf.thickness))
    _set(block, PROBES, lane, probes)
    weight, d, sampled = vec(bssrdf.weight), vec(bssrdf.d), vec(bssrdf.sampled)
    _set(block, UNIT, lane, 1.0 / (weight[0] + weight[1] + weight[2]))
    sided, cyclic = bssrdf.kind == MULTIPLE_OF_SLAB, bssrdf.kind == CYCLES
    t, _ = probe_frame(vec(bssrdf.n))
    _set3(block, TANGENT, lane, t)
    _set(block, CYCLIC, lane, 1.0 if cyclic else 0.0)
    _set(block, AXIS, lane, NEAREST * max3(d))
    if cyclic:
        b.has_cycles = 1
    _set(block, SIDED, lane, 1.0 if sided else 0.0)
    whole = bssrdf.kind == WHOLE or cyclic
    b.terms = max(b.terms, 4 if sided else (1 if whole else 2))
    for c in range(3):
        _set(block, REACHES + c, lane, (CYCLES_REACH if cyclic else REACH) * sampled[c] if weight[c] > 0.0 else -1.0)
        if whole:
            _set(block, BEND + c, lane, 0.0)
            _put_term(block, lane, 0, c, 0.0 if cyclic else weight[c], d[c])
            _put_term(block, lane, 1, c, 0.0, 1.0)
            _put_term(block, lane, UNIT_TERM, c, 1.0 if cyclic else 0.0, d[c])
            _put_term(block, lane, CYCLES_TERM, c, weight[c] / CYCLES_F if cyclic else 0.0, d[c])
            continue
        share = float(bssrdf.share[c])
        both, once = weight[c] / (1.0 - share), -share * weight[c] / (1.0 - share)
        near = far = wide_near = wide_far = 1.0
        if sided:
            near, far = float(bssrdf.near[c]), float(bssrdf.far[c])
            wide_near, wide_far = float(bssrdf.wide_near[c]), float(bssrdf.wide_far[c])
        _set(block, BEND + c, lane, float(bssrdf.bend[c]) if sided else 0.0)
        d0 = float(bssrdf.single[c])
        _put_term(block, lane, 0, c, near * both, wide_near * d[c])
        _put_term(block, lane, 1, c, near * once, wide_near * d0)
        _put_term(block, lane, 2, c, far * both, wide_far * d[c])
        _put_term(block, lane, 3, c, far * once, wide_far * d0)
    return lane


@device
def pad_lanes(block, multiple):
    """Fill lanes up to a multiple with domains that get nothing; how many there are then."""
    b = block_at(block, 0)
    n = (b.domains + multiple - 1) // multiple * multiple
    for lane in range(b.domains, n):
        for row in range(_WORK):
            _set(block, row, lane, -1.0)
        _set(block, PROBES, lane, 0.0)
        _set(block, UNIT, lane, 0.0)
    return n
