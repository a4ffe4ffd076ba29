"""Where the path of a pixel may enter a medium, and the walk that it has taken from there: the ENTRANCE record.

The path up to there belongs to the pixel's domain: lens, place in the pixel, transparent surfaces before it, and, of
several closures that scatter, one chosen by chance. Whether the path takes that lobe, with the probability `chance`, is
a part of the sample: who takes another one has a null sample, and is still lit by the walks of others.

A walk is *connected* at its first vertex where it has entered by a diffuse lobe, or leaves at once. One that has been
refracted goes into a narrow cone: its first segment is done again from each entrance, by its own random numbers, and it
is connected at its second vertex (`bent`). What lies behind the vertex is one for all.
"""

from ....kernels.core import rng
from ....kernels.core.jit import device, inlined
from ....kernels.core.memory import record_at
from ....kernels.core.records import closure_at
from ....kernels.core.records.layout import record
from ....kernels.core.vec import is_black, madd, mul, put, scale, transform_point, vec
from ....kernels.geometry.placed import placed_at
from ....kernels.lobes.closure import ENTRY_SKIN, P_ANISOTROPY, P_BURLEY, P_ENTRY
from ....kernels.path.state import DIM_DIRECTION, DIMENSIONS
from ....kernels.subsurface.entry import entry_lobe
from ....kernels.subsurface.walk import channels, probabilities
from ..subsurface.scatterer import scatterer_of

ENTRANCE = record(
    "pixel",  # address of what `contribute` adds to
    "opens",  # 1: there is an entrance
    "taken",  # 1: the path has entered here
    "closure",  # of the point, while its path is followed
    "dimension",  # PATH.dimension
    "instance",
    "crossed",  # transparent surfaces before
    "group",  # the first entrance of the block that shares with this one
    ("time", 1),
    ("p", 3),
    ("p_object", 3),
    ("error", 1),
    ("n", 3),  # of the closure
    ("ng", 3),
    ("wo", 3),
    ("entry", 1),
    ("alpha", 1),  # of the lobe that refracts
    ("ior", 1),
    ("g", 1),
    ("sigma_t", 3),
    ("albedo", 3),
    ("carried", 3),  # what enters by the closure, as the walk has it, whatever the chance
    ("chances", 3),  # that the path enters and a segment is sampled by a channel's extinction
    # The walk from here, where it brings light:
    "walk",  # NO_WALK …: what it does at the vertex where it is connected
    "bent",
    "diffuse",  # 1: it has entered by the diffuse lobe
    ("numbers", 4),  # by which it enters and its first segment is as long as it is
    ("vertex", 3),
    ("exit_n", 3),  # where it leaves
    # Where it scatters: the direction behind the vertex, and what WALKED tells of all that follows.
    ("d_behind", 3),
    "scattered",
    "similar_scattered",
    ("length", 1),
    ("similar_length", 1),
    "events",  # of scattering, all of them
    # What it brings to its own pixel; then what all walks bring here, by how often they scatter: not, once, more often.
    ("direct", 3),
    ("indirect", 3),
    ("lit_directly", 9),
    ("lit_indirectly", 9),
    # How the walk that is looked at would begin here, see `begin`.
    ("begun", 3),
    ("density", 1),
    ("bend", 3),  # object space: where its way to the vertex begins, or bends
    ("distance", 1),  # of that from the vertex
    ("entered", 1),  # and from here
    "segment",  # which one leads there, see kernels.geometry.segments
)
entrance_at = record_at(ENTRANCE)
NO_WALK, LEAVES, SCATTERS = 0, 1, 2

# What may differ between those who share walks: extinctions by this factor, albedos by so much.
LIKE_EXTINCTION, LIKE_ALBEDO = 1.1, 0.02


@device
def note_entrance(scene, path, sp, e, floor, mediums):
    """Fill the ENTRANCE of a path at its vertex sp, before it is scattered there; floor: see `walk.channels`.

    mediums: bits 1 and 2: media, and materials that ask for BURLEY, are walked through.
    """
    chosen, share, _taken, chance = scatterer_of(sp, path)
    if chosen < 0:
        return
    c = closure_at(sp.closures, chosen)
    if mediums & (2 if c.p[P_BURLEY] != 0.0 else 1) == 0:
        return
    throughput = scale(mul(vec(path.throughput), vec(c.weight)), 1.0 / share)
    carried, sigma_t, albedo = channels(c, throughput, floor)
    if not carried[0] + carried[1] + carried[2] > 0.0:
        return
    e.opens = 1
    e.closure = chosen
    e.dimension = path.dimension
    e.instance = sp.instance
    e.crossed = path.transparent_bounce
    e.time = path.time
    put(e.p, vec(sp.p))
    put(e.p_object, transform_point(placed_at(scene, sp.instance).to_object, vec(sp.p)))
    e.error = sp.error
    put(e.n, vec(c.n))
    put(e.ng, vec(sp.ng))
    put(e.wo, vec(sp.wo))
    e.entry = c.p[P_ENTRY]
    e.alpha = 1.0 if e.entry == ENTRY_SKIN else c.alpha_x
    e.ior = c.ior
    e.g = c.p[P_ANISOTROPY]
    put(e.sigma_t, sigma_t)
    put(e.albedo, albedo)
    put(e.carried, carried)
    put(e.chances, scale(probabilities(carried, albedo), chance))


@device
def is_alike(a, b):
    """Whether two entrances may share walks: through one instance, at one time, through media that are much alike."""
    if a.instance != b.instance or a.time != b.time or a.crossed != b.crossed or a.entry != b.entry or a.g != b.g:
        return False
    for k in range(3):
        if (a.carried[k] > 0.0) != (b.carried[k] > 0.0):
            return False
        if a.carried[k] > 0.0:
            x, y = a.sigma_t[k], b.sigma_t[k]
            if max(x, y) > LIKE_EXTINCTION * min(x, y) or abs(a.albedo[k] - b.albedo[k]) > LIKE_ALBEDO:
                return False
    return True


@device
def note_walk(e, path, sp, walked):
    """Keep the walk that has left at sp; WALKED has events where it has scattered."""
    u0, u1 = rng.sample2(path.key, path.sample, e.dimension + DIM_DIRECTION)
    v0, v1 = rng.sample2(path.key, path.sample, e.dimension + DIMENSIONS)
    diffuse, _, u0 = entry_lobe(e.entry, e.alpha, u0)
    e.diffuse = 1 if diffuse else 0
    e.events = walked.events
    e.bent = 1 if walked.events > 0 and not diffuse else 0
    if e.events == e.bent:
        e.walk = LEAVES
        put(e.vertex, vec(sp.p))
        put(e.exit_n, vec(sp.ng))
    else:
        e.walk = SCATTERS
        e.scattered = walked.scattered - e.bent
        e.similar_scattered = walked.similar_scattered
        e.length = walked.length
        e.similar_length = walked.similar_length
        put(e.vertex, vec(walked.p))
        put(e.d_behind, vec(walked.d_behind))
    if e.bent:
        e.numbers[0], e.numbers[1], e.numbers[2], e.numbers[3] = u0, u1, v0, v1
        if e.walk == SCATTERS:
            e.length -= walked.t_behind
            put(e.vertex, madd(vec(walked.p), vec(walked.d_behind), walked.t_behind))
            put(e.d_behind, vec(walked.d_after))


@inlined
def note_light(e, direct, indirect):
    """Keep the light that the walk brings; one that brings none is a null sample."""
    put(e.direct, direct)
    put(e.indirect, indirect)
    if is_black(direct) and is_black(indirect):
        e.walk = NO_WALK
