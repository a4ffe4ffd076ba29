"""What a random walk was like that has scattered and left: the WALKED record, for who gives it to other pixels."""

from ..core.jit import inlined
from ..core.memory import record_at
from ..core.records.layout import record
from ..core.records.scratch import shared_area
from ..core.vec import put

WALKED = record(
    ("p", 3),  # the first vertex of scattering, world space
    ("d", 3),  # the direction of the first segment, world space, which has the length
    ("t", 1),
    # The segments behind the first: the directions of two of them, and the length of one,
    ("d_behind", 3),
    ("t_behind", 1),
    ("d_after", 3),
    # how long they are and how often light has been scattered at their ends: through the medium itself, and through the
    # similar one that takes its place.
    ("length", 1),
    ("similar_length", 1),
    "scattered",
    "similar_scattered",
    "events",  # how often light has been scattered in all; 0: the walk has not left
    "turn",  # the number of the first segment through the similar medium, 0: there is none
)
walked_at = record_at(WALKED)
_WALKED = shared_area(WALKED.itemsize)


@inlined
def walked_in(scratch):
    """The WALKED of the last random walk of a tile, as long as no other method has traced subsurface light."""
    return walked_at(scratch + _WALKED, 0)


@inlined
def note_vertex(walked, p, d, t):
    """The first vertex of a walk, and the segment that leads to it."""
    put(walked.p, p)
    put(walked.d, d)
    walked.t = t
    walked.turn = 0
    walked.events = 0


@inlined
def note_segment(walked, segment, d, t):
    """One of the two segments behind the first, of which the last ends where that is found to end."""
    if segment == 1:
        put(walked.d_behind, d)
        walked.t_behind = t
    else:
        put(walked.d_after, d)


@inlined
def note_similar(walked, length, segment):
    """With a segment the walk goes on in the similar medium, after so much length behind the first vertex."""
    walked.length = length
    walked.turn = segment


@inlined
def note_end(walked, length, segment):
    """With a segment the walk leaves, after so much length in the medium where that is."""
    walked.events = segment
    walked.similar_length = 0.0
    walked.similar_scattered = 0
    if walked.turn == 0:
        walked.length = length
        walked.scattered = segment - 1
    else:
        walked.similar_length = length
        walked.scattered = walked.turn - 1
        walked.similar_scattered = segment - walked.turn
