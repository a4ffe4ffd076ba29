"""Partners by an involution: j is i's partner where i is j's, so that each pair's two shifts serve both of its pixels.

Pairwise MIS in pixel i needs T_{j→i}(X_j), the candidate, and T_{i→j}(X_i), for the weight of its own sample; pixel j
needs exactly these two (ReSTIR PT Enhanced, "paired spatial reuse"). A partner is found by XOR of the pixel's
coordinates with a mask that is one for all pixels of a frame, a round and an index. Pairs stay in blocks, which begin
elsewhere in each frame: what the pixels of a block share would else be seen as squares.
"""

from ...kernels.core import rng
from ...kernels.core.jit import device, inlined
from ...kernels.core.memory import load_i64, store_i64

LARGEST_BLOCK = 32


@device
def block_of(radius):
    """The side of the blocks that pairs stay in: the largest power of two that is not above `radius`, 2 to 32."""
    block = 2
    while 2 * block <= radius and block < LARGEST_BLOCK:
        block *= 2
    return block


@device
def draw_masks(to, seed, turn, count, block, left, below):
    """Store int64 [1 + count, 2]: by how much blocks lie to the left and below of multiples of their side, and what
    each of `count` partners of all pixels differ by, bits of x and of y, not both 0.

    The masks of a round are different, where there are as many: the first by chance, the others evenly behind it.
    """
    masks = block * block - 1
    first = rng.hash_combine(rng.hash_combine(seed, 0x50414952), turn) % masks
    store_i64(to, 0, left)
    store_i64(to, 1, below)
    for index in range(count):
        mask = 1 + (first + index * max(masks // count, 1)) % masks
        store_i64(to, 2 * index + 2, mask % block)
        store_i64(to, 2 * index + 3, mask // block)


@inlined
def partner(masks, index, x, y):
    """The index-th partner (x, y) of a pixel."""
    left, below = load_i64(masks, 0), load_i64(masks, 1)
    return (
        ((x + left) ^ load_i64(masks, 2 * index + 2)) - left,
        ((y + below) ^ load_i64(masks, 2 * index + 3)) - below,
    )
