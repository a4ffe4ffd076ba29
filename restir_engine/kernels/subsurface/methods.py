"""Subsurface scattering as integrators see it: from the closure that was chosen to the point where light leaves.

The methods are entries, compiled when a scene first needs one, and share this contract. On entering, `sp` is the point
where light enters (seen from outside), `sp.scatterer` the closure, and `path.throughput` contains the closure's weight
by the probability of its choice. A method returns the path's next event. Unless that is ENDS, `sp` is the point where
light leaves, seen from outside, with one Lambert closure of weight 1 about its own (bumped) normal, and
`path.throughput`, `path.dimension` and `path.scattering` are up to date. What a method gathers on the way it
contributes itself; where that includes the light that falls straight on the point where the path leaves, the event is
LIT, else SHADES.
"""

import numpy as np

from ..core.jit import Entry, inlined, load
from ..core.memory import address, call_for_outcome, load_i64, record_address
from ..core.records import MATERIAL_BURLEY, MATERIAL_SUBSURFACE, SCENE_HAS_SUBSURFACE, closure_at
from ..lobes.closure import P_BURLEY
from ..path.state import ENDS
from . import method_table as at
from .diffusion import diffusion, diffusion_exits
from .hybrid import hybrid, hybrid_exits
from .irradiance_cache import light_from_cache
from .probe import note_hit
from .slabs import slab_tables
from .walk import random_walk

# By RenderSettings.sss_method: what follows light through a medium, and through a material that asks for BURLEY.
METHODS: dict[str, tuple[Entry, Entry]] = {
    "FROM_MATERIAL": (random_walk, diffusion),
    "RANDOM_WALK": (random_walk, random_walk),
    "HYBRID": (hybrid, hybrid),
    "DIFFUSION": (diffusion, diffusion),
}

# The code by which a method that knows a BSSRDF finds it and exits, for who lights them himself. Path and point stand
# in working memory as for the method; the last argument is what is wanted (bssrdf.EXITS …). The BSSRDF's exits come
# first, their events are 2. Returns how many there are, -1: no light enters. Their weights contain path.throughput.
EXITS: dict[Entry, Entry] = {diffusion: diffusion_exits, hybrid: hybrid_exits}


@inlined
def scatter(scene, integrator, film, scratch, path, sp):
    """Follow light through the medium under `sp` to where it leaves; returns the path's next event."""
    burley = 1 if closure_at(sp.closures, sp.scatterer).p[P_BURLEY] != 0.0 else 0
    code = load_i64(integrator.scatter, at.MEDIUM + burley)
    if code == 0:
        return ENDS
    return call_for_outcome(code, record_address(scene), record_address(integrator), record_address(film), scratch, 0)


def scatter_entries(scene_flags: int, method: str = "FROM_MATERIAL", options: int = 0, cache: int = 0) -> np.ndarray:
    """The table that INTEGRATOR.scatter points to; what the scene needs of code is compiled where it is not yet.

    method: a name of METHODS; options: bits of method_table.FLAGS; cache: the address of an irradiance cache.
    """
    table = np.zeros(at.SIZE, np.int64)
    if scene_flags & SCENE_HAS_SUBSURFACE:
        medium, burley = METHODS[method]
        load({medium, burley, note_hit} | ({light_from_cache} if cache else set()))
        table[at.MEDIUM], table[at.BURLEY] = medium.address, burley.address
        table[at.NOTE_HIT] = note_hit.address
        table[at.ALBEDOS] = address(slab_tables())
        table[at.FLAGS] = options
        if cache:
            table[at.LIGHT_FROM_CACHE], table[at.CACHE] = light_from_cache.address, cache
    return table


def exits_flag(method: str) -> int:
    """The MATERIAL_* bit of what a name of METHODS follows by a method that knows a BSSRDF; 0: nothing."""
    medium, burley = METHODS[method]
    if medium in EXITS:
        return MATERIAL_SUBSURFACE
    return MATERIAL_BURLEY if burley in EXITS else 0


def exits_entries(method: str) -> tuple[int, int]:
    """Addresses of the code of EXITS for media and for materials that ask for BURLEY, compiled; 0: there is none."""
    found = (EXITS.get(entry) for entry in METHODS[method])
    return tuple(entry.address if entry else 0 for entry in found)
