"""Perlin's gradient noise (Perlin 2002) in one to four dimensions.

The 2ⁿ corners of a lattice cell are the lanes of one vector: their hashes and gradients are computed side by side
in single precision, which is what the noise of Cycles has.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from .hashing import emit_lookup3, splat

_F32, _F64, _I32 = ir.FloatType(), ir.DoubleType(), ir.IntType(32)


def _select_negative(builder, value, hashes, bit):
    """-value where the bit of the hash is set."""
    flag = builder.and_(hashes, splat(hashes.type, bit))
    negative = builder.icmp_unsigned("!=", flag, splat(hashes.type, 0))
    return builder.select(negative, builder.fneg(value), value)


def _below(builder, hashes, limit, yes, no):
    return builder.select(builder.icmp_unsigned("<", hashes, splat(hashes.type, limit)), yes, no)


def _gradient(builder, hashes, offsets):
    """The dot product of a corner's gradient with the offset from the corner, in all lanes."""
    dimensions = len(offsets)
    kind = offsets[0].type
    hashes = builder.and_(hashes, splat(hashes.type, (15, 7, 15, 31)[dimensions - 1]))
    if dimensions == 1:
        slope = builder.and_(hashes, splat(hashes.type, 7))
        slope = builder.fadd(builder.uitofp(slope, kind), splat(kind, 1.0))
        return _select_negative(builder, builder.fmul(slope, offsets[0]), hashes, 8)
    if dimensions == 2:
        x, y = offsets
        parts = [_below(builder, hashes, 4, x, y), _below(builder, hashes, 4, y, x)]
        parts[1] = builder.fmul(parts[1], splat(kind, 2.0))
    elif dimensions == 3:
        x, y, z = offsets
        odd = builder.icmp_unsigned("==", builder.or_(hashes, splat(hashes.type, 2)), splat(hashes.type, 14))
        far = builder.select(odd, x, z)
        parts = [_below(builder, hashes, 8, x, y), _below(builder, hashes, 4, y, far)]
    else:
        x, y, z, w = offsets
        parts = [_below(builder, hashes, 24, x, y), _below(builder, hashes, 16, y, z), _below(builder, hashes, 8, z, w)]
    total = None
    for bit, part in enumerate(parts):
        part = _select_negative(builder, part, hashes, 1 << bit)
        total = part if total is None else builder.fadd(total, part)
    return total


def _broadcast(builder, value, lanes):
    vector = builder.insert_element(ir.Constant(ir.VectorType(value.type, lanes), ir.Undefined), value, _I32(0))
    return builder.shuffle_vector(vector, vector, ir.Constant(ir.VectorType(_I32, lanes), [0] * lanes))


def _fade(builder, t):
    """6t⁵ - 15t⁴ + 10t³."""
    inner = builder.fadd(builder.fmul(t, splat(_F32, 6.0)), splat(_F32, -15.0))
    inner = builder.fadd(builder.fmul(t, inner), splat(_F32, 10.0))
    return builder.fmul(builder.fmul(builder.fmul(t, t), t), inner)


def _halve(builder, values, t):
    """Interpolate neighbouring lanes: half as many are left."""
    lanes = values.type.count
    indices = ir.VectorType(_I32, lanes // 2)
    even = builder.shuffle_vector(values, values, ir.Constant(indices, list(range(0, lanes, 2))))
    odd = builder.shuffle_vector(values, values, ir.Constant(indices, list(range(1, lanes, 2))))
    t = _broadcast(builder, t, lanes // 2)
    return builder.fadd(even, builder.fmul(t, builder.fsub(odd, even)))


def _emit_noise(builder, coordinates):
    lanes = 1 << len(coordinates)
    floor = builder.module.declare_intrinsic("llvm.floor", [_F64])
    keys, offsets, fractions = [], [], []
    for axis, x in enumerate(coordinates):
        whole = builder.call(floor, [x])
        fraction = builder.fptrunc(builder.fsub(x, whole), _F32)
        upper = [(lane >> axis) & 1 for lane in range(lanes)]
        cell = builder.trunc(builder.fptosi(whole, ir.IntType(64)), _I32)
        keys.append(builder.add(_broadcast(builder, cell, lanes), ir.Constant(ir.VectorType(_I32, lanes), upper)))
        steps = ir.Constant(ir.VectorType(_F32, lanes), [float(bit) for bit in upper])
        offsets.append(builder.fsub(_broadcast(builder, fraction, lanes), steps))
        fractions.append(fraction)
    values = _gradient(builder, emit_lookup3(builder, keys), offsets)
    for fraction in fractions:
        values = _halve(builder, values, _fade(builder, fraction))
    return builder.fpext(builder.extract_element(values, _I32(0)), _F64)


@intrinsic
def perlin(typingctx, p):
    """Gradient noise at a tuple of one to four coordinates, not scaled; 0 on whole numbers. |x| < 2⁶³."""

    def codegen(context, builder, signature, args):
        return _emit_noise(builder, cgutils.unpack_tuple(builder, args[0]))

    return types.float64(p), codegen
