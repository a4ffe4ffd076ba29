"""What reuse has done for a pixel, for two passes: how its sample got there, and how many shifts succeed.

Seen where a sample has been chosen, by entries that stand in place of the technique's `merge` and do what that does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ....kernels.core.jit import Entry, device, entry
from ...resampling.frame import frame_at
from ...resampling.inputs import domain_of
from ...resampling.resample import target_of
from ...resampling.technique import SHIFTED_BYTES, domain_at
from .invert import redraw, redraw_line, redraw_numbers
from .sample import KEPT, OWN, REPLAYED, sample_at, watched_of

if TYPE_CHECKING:
    from ....film import Film
    from ...resampling.frame import Frame

SHIFT_PASS, REUSE_PASS = "Subsurface Shift", "Subsurface Reuse"


@device
def _watch(domain, shifted, table, n, chosen):
    d = domain_at(domain, 0)
    w = watched_of(frame_at(d.frame, 0), d.pixel)
    w.shifts += n - 1
    for i in range(1, n):
        if target_of(table, i) > 0.0:
            w.succeeded += 1
    if chosen > 0:
        source = domain_at(domain_of(d.scratch, chosen), 0)
        before = sample_at(frame_at(source.frame, 0).reservoirs, source.pixel)
        after = sample_at(shifted + SHIFTED_BYTES * chosen, 0)
        same = before.primitive == after.primitive and before.u == after.u and before.v == after.v
        w.origin = KEPT if same else REPLAYED


@entry
def watch(domain, shifted, table, n, chosen):
    """See resampling.technique, merge."""
    _watch(domain, shifted, table, n, chosen)


@entry
def watch_and_redraw(domain, shifted, table, n, chosen):
    """The same, and `redraw_numbers`."""
    _watch(domain, shifted, table, n, chosen)
    redraw(domain, shifted, chosen, True)


@entry
def watch_and_redraw_line(domain, shifted, table, n, chosen):
    """The same, and `redraw_line`."""
    _watch(domain, shifted, table, n, chosen)
    redraw(domain, shifted, chosen, False)


WATCHED: dict[Entry | None, Entry] = {
    None: watch,
    redraw_numbers: watch_and_redraw,
    redraw_line: watch_and_redraw_line,
}  # what does as a merge does, and watches


def watches(passes: frozenset[str]) -> bool:
    """Whether any of the passes is asked for."""
    return not passes.isdisjoint({SHIFT_PASS, REUSE_PASS})


def add_watched(film: Film, passes: frozenset[str], frame: Frame) -> None:
    """Add a finished companion to the passes that are asked for."""
    reservoirs, watched = frame.reservoirs[0], frame.domains["watched"]
    if SHIFT_PASS in passes:
        found = reservoirs["contribution_weight"] > 0.0
        ways = [found & (watched["origin"] == way) for way in (OWN, KEPT, REPLAYED)]
        film.sums(SHIFT_PASS)[:] += np.stack([*ways, found], -1)
    if REUSE_PASS in passes:
        share = watched["succeeded"] / np.maximum(watched["shifts"], 1)
        there = reservoirs["confidence"] > 0.0
        values = np.stack([reservoirs["confidence"], share, frame.radii], -1)
        film.sums(REUSE_PASS)[:] += np.where(there[..., None], values, 0.0)
