"""Shader instructions 40–59: colours, as Cycles' nodes define them. Tables are float32 triples or quadruples."""

from ..core.jit import device, entry
from ..core.memory import load_f32, load_f64, load_i32, store_f64
from ..core.records import scene_at
from ..core.vec import lerp, load3_f32, store3_f64
from . import opcodes as ops
from .math_ops import clamp, divide, floor
from .operands import number, opcode, triple


@device
def rgb_to_hsv(c):
    high, low = max(c[0], max(c[1], c[2])), min(c[0], min(c[1], c[2]))
    span = high - low
    saturation = divide(span, high)
    if saturation == 0.0:
        return (0.0, 0.0, high)
    if c[0] == high:
        hue = (c[1] - c[2]) / span
    elif c[1] == high:
        hue = 2.0 + (c[2] - c[0]) / span
    else:
        hue = 4.0 + (c[0] - c[1]) / span
    hue *= 1.0 / 6.0
    return (hue + 1.0 if hue < 0.0 else hue, saturation, high)


@device
def hsv_to_rgb(c):
    s, v = c[1], c[2]
    if s == 0.0:
        return (v, v, v)
    h = 0.0 if c[0] == 1.0 else c[0] * 6.0
    sector = floor(h)
    f = h - sector
    p, q, t = v * (1.0 - s), v * (1.0 - s * f), v * (1.0 - s * (1.0 - f))
    if sector == 0.0:
        return (v, t, p)
    if sector == 1.0:
        return (q, v, p)
    if sector == 2.0:
        return (p, v, t)
    if sector == 3.0:
        return (p, q, v)
    if sector == 4.0:
        return (t, p, v)
    return (v, p, q)


@device
def rgb_to_hsl(c):
    high, low = max(c[0], max(c[1], c[2])), min(c[0], min(c[1], c[2]))
    lightness = min(1.0, 0.5 * (high + low))
    if high == low:
        return (0.0, 0.0, lightness)
    span = high - low
    saturation = divide(span, 2.0 - high - low) if lightness > 0.5 else divide(span, high + low)
    if high == c[0]:
        hue = (c[1] - c[2]) / span + (6.0 if c[1] < c[2] else 0.0)
    elif high == c[1]:
        hue = (c[2] - c[0]) / span + 2.0
    else:
        hue = (c[0] - c[1]) / span + 4.0
    return (hue * (1.0 / 6.0), saturation, lightness)


@device
def hsl_to_rgb(c):
    h, lightness = c[0] * 6.0, c[2]
    chroma = (1.0 - abs(2.0 * lightness - 1.0)) * c[1]
    r = clamp(abs(h - 3.0) - 1.0, 0.0, 1.0)
    g = clamp(2.0 - abs(h - 2.0), 0.0, 1.0)
    b = clamp(2.0 - abs(h - 4.0), 0.0, 1.0)
    return ((r - 0.5) * chroma + lightness, (g - 0.5) * chroma + lightness, (b - 0.5) * chroma + lightness)


@device
def _blend_light(mode, t, a, b):
    """BLEND_MODES 0 to 7 of one component."""
    s = 1.0 - t
    if mode == 0:
        return a * s + b * t
    if mode == 1:
        return a * s + min(a, b) * t
    if mode == 2:
        return a * s + a * b * t
    if mode == 3:
        scale = s + t * b
        return 0.0 if scale <= 0.0 else clamp(1.0 - (1.0 - a) / scale, 0.0, 1.0)
    if mode == 4:
        return a * s + max(a, b) * t
    if mode == 5:
        return 1.0 - (s + t * (1.0 - b)) * (1.0 - a)
    if mode == 6:
        rest = 1.0 - t * b
        if a == 0.0:
            return 0.0
        return 1.0 if rest <= 0.0 else min(a / rest, 1.0)
    return a + b * t


@device
def _blend_contrast(mode, t, a, b):
    """BLEND_MODES 8 to 14 of one component."""
    s = 1.0 - t
    if mode == 8:
        if a < 0.5:
            return a * (s + 2.0 * t * b)
        return 1.0 - (s + 2.0 * t * (1.0 - b)) * (1.0 - a)
    if mode == 9:
        screen = 1.0 - (1.0 - b) * (1.0 - a)
        return s * a + t * ((1.0 - a) * b * a + a * screen)
    if mode == 10:
        return a + t * (2.0 * b - 1.0)
    if mode == 11:
        return a * s + abs(a - b) * t
    if mode == 12:
        return max(a * s + (a + b - 2.0 * a * b) * t, 0.0)
    if mode == 13:
        return a - b * t
    return a if b == 0.0 else s * a + t * a / b


@device
def _blend_hsv(mode, t, a, b):
    """BLEND_MODES 15 to 18."""
    x, y = rgb_to_hsv(a), rgb_to_hsv(b)
    if mode == 18:
        return hsv_to_rgb((x[0], x[1], (1.0 - t) * x[2] + t * y[2]))
    if mode == 16:
        return a if x[1] == 0.0 else hsv_to_rgb((x[0], (1.0 - t) * x[1] + t * y[1], x[2]))
    if y[1] == 0.0:
        return a
    return lerp(a, hsv_to_rgb((y[0], x[1] if mode == 15 else y[1], x[2])), t)


@device
def blend(mode, t, a, b):
    """b mixed into a by one of BLEND_MODES and factor t."""
    if mode < 8:
        x, y = _blend_light(mode, t, a[0], b[0]), _blend_light(mode, t, a[1], b[1])
        return (x, y, _blend_light(mode, t, a[2], b[2]))
    if mode < 15:
        x, y = _blend_contrast(mode, t, a[0], b[0]), _blend_contrast(mode, t, a[1], b[1])
        return (x, y, _blend_contrast(mode, t, a[2], b[2]))
    return _blend_hsv(mode, t, a, b)


@device
def _hue_saturation(hue, saturation, value, factor, c):
    x = rgb_to_hsv(c)
    turned = x[0] + hue + 0.5
    d = hsv_to_rgb((turned - floor(turned), clamp(x[1] * saturation, 0.0, 1.0), x[2] * value))
    mixed = lerp(c, d, factor)
    return (max(mixed[0], 0.0), max(mixed[1], 0.0), max(mixed[2], 0.0))


@device
def _gamma(x, gamma):
    if gamma == 0.0:
        return 1.0
    return x**gamma if x > 0.0 else x


@device
def _bright_contrast(x, brightness, contrast):
    return max((1.0 + contrast) * x + brightness - 0.5 * contrast, 0.0)


@device
def table_lookup(table, stride, size, interpolated, extrapolated, x):
    """Entry x (0 … 1) of a table with entries `stride` floats apart; beyond its ends constant, or a straight line."""
    if extrapolated and x < 0.0:
        end = load_f32(table, 0)
        return end - (end - load_f32(table, stride)) * x * (size - 1.0)
    if extrapolated and x > 1.0:
        end = load_f32(table, (size - 1) * stride)
        return end + (end - load_f32(table, (size - 2) * stride)) * (x - 1.0) * (size - 1.0)
    place = clamp(x, 0.0, 1.0) * (size - 1.0) if x == x else 0.0
    index = int(place)
    t = place - index
    first = load_f32(table, index * stride)
    if not interpolated or t == 0.0:
        return first
    return first * (1.0 - t) + load_f32(table, (index + 1) * stride) * t


@device
def _ramp(tables, registers, code, at):
    out, table = load_i32(code, at), tables + 4 * load_i32(code, at + 1)
    size, interpolated = load_i32(code, at + 2), load_i32(code, at + 3) != 0
    x = number(registers, code, at + 4)
    for k in range(4):
        store_f64(registers, out + k, table_lookup(table + 4 * k, 4, size, interpolated, False, x))


@device
def _curve(tables, registers, code, at, components):
    """One curve of a number, or three of a colour."""
    out, table = load_i32(code, at), tables + 4 * load_i32(code, at + 1)
    size, extrapolated = load_i32(code, at + 2), load_i32(code, at + 3) != 0
    factor = number(registers, code, at + 4)
    low, high = number(registers, code, at + 6), number(registers, code, at + 7)
    source = load_i32(code, at + 5)
    for k in range(components):
        x = load_f64(registers, source + k)
        y = table_lookup(table + 4 * k, components, size, True, extrapolated, divide(x - low, high - low))
        store_f64(registers, out + k, (1.0 - factor) * x + factor * y)


@device
def _blackbody(tables, registers, code, at):
    """Fitted linear Rec. 709 colour of a black body, below 0 where it is outside of these primaries.

    Rows of the table: end temperature, r (3), g (3), b (4).
    """
    table = tables + 4 * load_i32(code, at + 1)
    t = max(number(registers, code, at + 2), 800.0)
    row = 0
    while row < 7 and t >= load_f32(table, row * 11):
        row += 1
    base = row * 11 + 1
    r, g = load3_f32(table + 4 * base, 0), load3_f32(table + 4 * base, 1)
    blue = (load_f32(table, base + 6) * t + load_f32(table, base + 7)) * t + load_f32(table, base + 8)
    red = r[0] / t + r[1] * t + r[2]
    green = g[0] / t + g[1] * t + g[2]
    return (red, green, blue * t + load_f32(table, base + 9))


@device
def _adjust(op, registers, code, at):
    """Instructions on one colour and a few numbers."""
    if op == ops.HUE_SATURATION:
        return _hue_saturation(
            number(registers, code, at + 1),
            number(registers, code, at + 2),
            number(registers, code, at + 3),
            number(registers, code, at + 4),
            triple(registers, code, at + 5),
        )
    if op == ops.BRIGHT_CONTRAST:
        c, b, k = triple(registers, code, at + 1), number(registers, code, at + 2), number(registers, code, at + 3)
        return (_bright_contrast(c[0], b, k), _bright_contrast(c[1], b, k), _bright_contrast(c[2], b, k))
    if op == ops.GAMMA:
        c, g = triple(registers, code, at + 1), number(registers, code, at + 2)
        return (_gamma(c[0], g), _gamma(c[1], g), _gamma(c[2], g))
    if op == ops.INVERT:
        c = triple(registers, code, at + 2)
        return lerp(c, (1.0 - c[0], 1.0 - c[1], 1.0 - c[2]), number(registers, code, at + 1))
    c = triple(registers, code, at + 1)
    return (clamp(c[0], 0.0, 1.0), clamp(c[1], 0.0, 1.0), clamp(c[2], 0.0, 1.0))


@device
def _convert(op, mode, c):
    if mode == 0:
        return c
    if op == ops.SEPARATE_COLOR:
        return rgb_to_hsv(c) if mode == 1 else rgb_to_hsl(c)
    return hsv_to_rgb(c) if mode == 1 else hsl_to_rgb(c)


@entry
def color_op(scene, _sp, registers, code, at):
    """Run one instruction of this family."""
    scene = scene_at(scene, 0)
    op = opcode(code, at)
    if op == ops.RAMP:
        _ramp(scene.tables, registers, code, at)
        return
    if op == ops.CURVES:
        _curve(scene.tables, registers, code, at, 3)
        return
    if op == ops.CURVE:
        _curve(scene.tables, registers, code, at, 1)
        return
    if op == ops.MIX_COLOR:
        a, b = triple(registers, code, at + 3), triple(registers, code, at + 4)
        result = blend(load_i32(code, at + 1), number(registers, code, at + 2), a, b)
    elif op == ops.SEPARATE_COLOR or op == ops.COMBINE_COLOR:
        result = _convert(op, load_i32(code, at + 1), triple(registers, code, at + 2))
    elif op == ops.BLACKBODY:
        result = _blackbody(scene.tables, registers, code, at)
    else:
        result = _adjust(op, registers, code, at)
    store3_f64(registers, load_i32(code, at), result)
