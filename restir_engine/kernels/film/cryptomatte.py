"""Cryptomatte's slots of a pixel: pairs (id, weight) of float32, filled as ids are met; an id of 0 is none.

Friedman and Jones 2015. Where a pixel meets more ids than it has slots, the last one takes the weight of the rest, as
in Cycles.
"""

from ..core.jit import device
from ..core.memory import load_f32, store_f32


@device
def add_to_slots(slots, count, identity, weight):
    """Add a weight to the slot of an id; slots: the address of the first of `count`."""
    if weight == 0.0:
        return
    for k in range(count):
        found = load_f32(slots, 2 * k)
        if found == 0.0:
            store_f32(slots, 2 * k, identity)
        if found == 0.0 or found == identity or k == count - 1:
            store_f32(slots, 2 * k + 1, load_f32(slots, 2 * k + 1) + weight)
            return


@device
def merge_slots(slots, other, count):
    """Add the slots at `other` to those at `slots`."""
    for k in range(count):
        identity = load_f32(other, 2 * k)
        if identity == 0.0:
            return
        add_to_slots(slots, count, identity, load_f32(other, 2 * k + 1))
