"""Noise Texture: fractal sums of gradient noise (Musgrave et al., Texturing and Modeling).

One-dimensional noise lives on x. Amplitudes are scaled to about [-1, 1] by OSL's constants.
"""

from ...core.jit import device, entry
from ...core.memory import float_bits, load_i32, store_f64
from ..operands import fractal_operands, number
from .hashing import TO_UNIT, lookup3
from .lattice import perlin
from .rounding import floor, single, wrap

MULTIFRACTAL, FBM, HYBRID_MULTIFRACTAL, RIDGED_MULTIFRACTAL, HETERO_TERRAIN = 0, 1, 2, 3, 4
# Flags: dimensions | kind << 4 | these.
FLAG_NORMALIZE = 256
FLAG_COLOR = 512

_PERIOD = 100000.0  # the lattice repeats, so that float32 keeps its fractional bits


@device
def _in_period(x):
    if abs(x) < _PERIOD:
        return x
    return wrap(single(x), _PERIOD) + (0.5 if abs(x) >= 1000000.0 else 0.0)


@device
def signed_noise(dimensions, x, y, z, w):
    """Gradient noise in about [-1, 1]; 0 on lattice points."""
    x = _in_period(x)
    if dimensions == 1:
        return 0.2500 * perlin((x,))
    y = _in_period(y)
    if dimensions == 2:
        return 0.6616 * perlin((x, y))
    z = _in_period(z)
    if dimensions == 3:
        return 0.9820 * perlin((x, y, z))
    return 0.8344 * perlin((x, y, z, _in_period(w)))


@device
def fractal_noise(flags, x, y, z, w, detail, roughness, lacunarity, offset, gain):
    """A fractal sum of noise; a fraction of `detail` takes part of one more octave (none when ridged).

    With FLAG_NORMALIZE fractional Brownian motion lies in [0, 1] around 0.5.
    """
    kind = (flags >> 4) & 15
    octaves = int(detail)
    rest = detail - floor(detail)
    scale, power, reach = 1.0, 1.0, 0.0
    result = 1.0 if kind == MULTIFRACTAL else 0.0
    weight, before = 1.0, 0.0
    for i in range(octaves + 2):
        share = 1.0
        if i > octaves:
            share = rest
            if rest == 0.0 or kind == RIDGED_MULTIFRACTAL:
                break
        sample = signed_noise(flags & 15, scale * x, scale * y, scale * z, scale * w)
        if kind == FBM:
            before, result = result, result + sample * power
            reach += power
            if flags & FLAG_NORMALIZE == 0:
                result = before + share * (result - before)
        elif kind == MULTIFRACTAL:
            result *= share * power * sample + 1.0
        elif kind == HETERO_TERRAIN:
            # The first octave is not scaled by the terrain below it.
            result += share * (sample + offset) * power * (result if i > 0 else 1.0)
        elif kind == RIDGED_MULTIFRACTAL:
            signal = offset - abs(sample)
            signal *= signal * weight
            result += signal * power
            weight = min(max(signal * gain, 0.0), 1.0)
        else:
            if weight <= 0.001:
                break
            weight = min(weight, 1.0)
            signal = (sample + offset) * power
            result += share * weight * signal
            weight *= gain * signal
        power *= roughness
        scale *= lacunarity
    if kind == FBM and flags & FLAG_NORMALIZE:
        if rest == 0.0:
            return 0.5 * result / reach + 0.5
        previous = reach - power / roughness if roughness > 0.0 else 1.0
        a, b = before / previous, result / reach
        return 0.5 * (a + rest * (b - a)) + 0.5
    return result


@device
def _seed_offset(dimensions, seed, component):
    """A shift in [100, 200) that makes independent copies of a noise."""
    key = float_bits(seed)
    n = lookup3((key,)) if dimensions == 1 else lookup3((key, float_bits(component)))
    # Rounded where Cycles rounds: the octaves of a noise multiply the error.
    return single(100.0 + single(100.0 * single(n * TO_UNIT)))


@device
def _shifted(dimensions, seed, x, y, z, w):
    """The position of an independent copy of the noise."""
    return (
        single(x + _seed_offset(dimensions, seed, 0.0)),
        single(y + _seed_offset(dimensions, seed, 1.0)),
        single(z + _seed_offset(dimensions, seed, 2.0)),
        single(w + _seed_offset(dimensions, seed, 3.0)),
    )


@entry
def noise_op(_scene, _sp, registers, code, at):
    """Noise Texture: see opcodes.NOISE."""
    out = load_i32(code, at)
    p, scale, detail, roughness, lacunarity = fractal_operands(registers, code, at)
    offset = number(registers, code, at + 7)
    gain = number(registers, code, at + 8)
    distortion = number(registers, code, at + 9)
    flags = load_i32(code, at + 10)
    dimensions = flags & 15
    w = single(number(registers, code, at + 2) * scale)
    x, y, z = single(p[0] * scale), single(p[1] * scale), single(p[2] * scale)
    if dimensions == 1:
        x = w
    if distortion != 0.0:
        # Each component is displaced by its own copy of the noise; those beyond the dimensions do not matter.
        a, b, c, d = x, y, z, w
        for axis in range(dimensions):
            q = _shifted(dimensions, float(axis), x, y, z, w)
            step = distortion * signed_noise(dimensions, q[0], q[1], q[2], q[3])
            if axis == 0:
                a = single(x + step)
            elif axis == 1:
                b = single(y + step)
            elif axis == 2:
                c = single(z + step)
            else:
                d = single(w + step)
        x, y, z, w = a, b, c, d
    for copy in range(3 if flags & FLAG_COLOR else 1):
        q = (x, y, z, w)
        if copy > 0:
            q = _shifted(dimensions, float(dimensions + copy - 1), x, y, z, w)
        result = fractal_noise(flags, q[0], q[1], q[2], q[3], detail, roughness, lacunarity, offset, gain)
        if copy == 0:
            store_f64(registers, out, result)
        store_f64(registers, out + 1 + copy, result)
