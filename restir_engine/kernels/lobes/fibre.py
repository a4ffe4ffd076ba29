"""Lobes of fibres: what scatters all around a strand. Their code is called by address, see `CLOSURE.code`.

Hair is rare and its lobes are large, so that no kernel contains them. A fibre scatters by solid angle: its values have
no cosine, and there is no horizon.

Code of a fibre is an entry (closure, request, 0, 0, 0). With EVALUATE `asked` is the direction wi, `answer` the value
(rgb, without the weight) and the density by solid angle. With SAMPLE `asked` are three random numbers, `answer` is the
direction, and its last number is 0 where there is none.
"""

import math

from ..core.jit import device
from ..core.memory import call_entry, load_i64, record_address
from ..core.records import closure_at
from ..core.vec import cross, dot, frame, is_black, normalize, put, vec
from .closure import LABEL_GLOSSY, LABEL_REFLECT, LABEL_TRANSMIT, LOBE_FIBRE_REFLECTION, add_closure

EVALUATE, SAMPLE = 0, 1

# Where things stand in CLOSURE.p. α_x and α_y are widths along and around the strand, `t` is its tangent.
P_SIN_O = 0  # sine of wo's elevation above the plane across the strand
P_OFFSET = 1  # h: where across the strand the ray has hit, -1 … 1
P_WIDTH_R = 2  # along the strand, of the first reflection where it has one of its own
P_SIGMA = 3  # rgb: absorption by the strand's radius
P_ACROSS = 6  # unit vector across the strand and the ray
P_TILT = 9  # of the cuticle's scales, radians
P_MODEL = 10  # from here on what the model names


@device
def fibre_eval(c, wi):
    """(value rgb without the weight, pdf)."""
    put(c.asked, wi)
    call_entry(c.code, record_address(c), EVALUATE, 0, 0, 0)
    return c.answer[0], c.answer[1], c.answer[2], c.answer[3]


@device
def fibre_label(kind):
    """The label of all that a fibre scatters: most of the light that hair returns has gone through it."""
    return LABEL_GLOSSY | (LABEL_REFLECT if kind == LOBE_FIBRE_REFLECTION else LABEL_TRANSMIT)


@device
def fibre_sample(c, u0, u1, u2):
    """(label, wi)."""
    put(c.asked, (u0, u1, u2))
    call_entry(c.code, record_address(c), SAMPLE, 0, 0, 0)
    return fibre_label(c.kind) if c.answer[3] > 0.0 else 0, (c.answer[0], c.answer[1], c.answer[2])


@device
def blur_fibre(c, roughness):
    """Filter glossy: as in Cycles no width of hair's lobes below this."""
    c.alpha_x = max(c.alpha_x, roughness)
    c.alpha_y = max(c.alpha_y, roughness)
    c.p[P_WIDTH_R] = max(c.p[P_WIDTH_R], roughness)


@device
def add_fibre(scene, sp, kind, weight, tangent, code):
    """Append the lobe of a fibre along a tangent, run by the entry of the opcode `code`; the closure's index or -1."""
    i = add_closure(sp, kind, weight, vec(sp.n))
    if i < 0:
        return -1
    c = closure_at(sp.closures, i)
    wo, x = vec(sp.wo), normalize(tangent)
    if is_black(x):
        x, _y = frame(vec(sp.ng))
    y = normalize(cross(x, wo))
    if is_black(y):
        y, _z = frame(x)
    put(c.t, x)
    c.p[P_SIN_O] = min(max(dot(x, wo), -1.0), 1.0)
    c.p[P_OFFSET] = min(max(-dot(vec(sp.ng), y), -1.0), 1.0)
    for k in range(3):
        c.p[P_ACROSS + k] = y[k]
    put(c.albedo, (1.0, 1.0, 1.0))
    c.code = load_i64(scene.shader_entries, code)
    return i


@device
def around(c, wi):
    """(sine of wi's elevation above the plane across the strand, azimuth from wo's, towards P_ACROSS)."""
    x, y = vec(c.t), (c.p[P_ACROSS], c.p[P_ACROSS + 1], c.p[P_ACROSS + 2])
    return min(max(dot(x, wi), -1.0), 1.0), math.atan2(dot(y, wi), dot(cross(y, x), wi))


@device
def direction_around(c, sine, phi):
    """The direction of an elevation and an azimuth as `around` gives them."""
    x, y = vec(c.t), (c.p[P_ACROSS], c.p[P_ACROSS + 1], c.p[P_ACROSS + 2])
    z = cross(y, x)
    cosine = math.sqrt(max(1.0 - sine * sine, 0.0))
    a, b = cosine * math.sin(phi), cosine * math.cos(phi)
    return (
        sine * x[0] + a * y[0] + b * z[0],
        sine * x[1] + a * y[1] + b * z[1],
        sine * x[2] + a * y[2] + b * z[2],
    )


@device
def answer(c, value, pdf):
    """Put what EVALUATE is asked for."""
    c.answer[0], c.answer[1], c.answer[2] = value
    c.answer[3] = pdf


@device
def answer_direction(c, wi):
    """Put what SAMPLE is asked for."""
    c.answer[0], c.answer[1], c.answer[2] = wi
    c.answer[3] = 1.0
