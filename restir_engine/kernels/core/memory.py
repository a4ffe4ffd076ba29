"""Raw memory as kernels see it: addresses are int64; loads widen to float64 or int64.

The owner of an array (always on the Python side) keeps it alive while its address is in use. `address`
gives the address of a NumPy array; an address of 0 means that there is no array.
"""

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.cgutils import memset as _memset
from numba.extending import intrinsic

from .jit import inlined


def address(array: np.ndarray | None) -> int:
    """Address of a C-contiguous array, or 0 for None and for an empty array."""
    if array is None or array.size == 0:
        return 0
    if not array.flags.c_contiguous:
        raise ValueError("only C-contiguous arrays can be handed to kernels")
    return array.ctypes.data


_ELEMENTS = {
    "f32": (ir.FloatType(), types.float64),
    "f64": (ir.DoubleType(), types.float64),
    "u8": (ir.IntType(8), types.int64),
    "u16": (ir.IntType(16), types.int64),
    "i32": (ir.IntType(32), types.int64),
    "u32": (ir.IntType(32), types.int64),
    "i64": (ir.IntType(64), types.int64),
}


def _element_pointer(builder, element, base, index):
    pointer = builder.inttoptr(base, element.as_pointer())
    return builder.gep(pointer, [index])


def _loader(name):
    element, result = _ELEMENTS[name]

    @intrinsic
    def load(typingctx, base, index):
        signature = result(types.int64, types.int64)

        def codegen(context, builder, signature, args):
            value = builder.load(_element_pointer(builder, element, *args))
            if isinstance(element, ir.FloatType):
                return builder.fpext(value, ir.DoubleType())
            if isinstance(element, ir.IntType) and element.width < 64:
                widen = builder.zext if name.startswith("u") else builder.sext
                return widen(value, ir.IntType(64))
            return value

        return signature, codegen

    return load


def _storer(name):
    element, argument = _ELEMENTS[name]

    @intrinsic
    def store(typingctx, base, index, value):
        signature = types.void(types.int64, types.int64, argument)

        def codegen(context, builder, signature, args):
            base, index, value = args
            if isinstance(element, ir.FloatType):
                value = builder.fptrunc(value, element)
            elif isinstance(element, ir.IntType) and element.width < 64:
                value = builder.trunc(value, element)
            builder.store(value, _element_pointer(builder, element, base, index))
            return context.get_dummy_value()

        return signature, codegen

    return store


load_f32, store_f32 = _loader("f32"), _storer("f32")
load_f64, store_f64 = _loader("f64"), _storer("f64")
load_u8, store_u8 = _loader("u8"), _storer("u8")
load_u16 = _loader("u16")
load_i32, store_i32 = _loader("i32"), _storer("i32")
load_u32, store_u32 = _loader("u32"), _storer("u32")
load_i64, store_i64 = _loader("i64"), _storer("i64")


@inlined
def copy_words(target, source, count):
    """Copy `count` 64-bit words from one address to another, the first word first."""
    for k in range(count):
        store_i64(target, k, load_i64(source, k))


def record_at(dtype: np.dtype):
    """An intrinsic `at(address, index)` that gives a reference to the index-th record of `dtype` at address."""
    from numba.np.numpy_support import from_dtype

    record = from_dtype(dtype)
    size = dtype.itemsize

    @intrinsic
    def at(typingctx, base, index):
        signature = record(types.int64, types.int64)

        def codegen(context, builder, signature, args):
            base, index = args
            offset = builder.mul(index, ir.Constant(ir.IntType(64), size))
            return builder.inttoptr(builder.add(base, offset), context.get_value_type(record))

        return signature, codegen

    return at


@intrinsic
def prefetch(typingctx, address):
    """Ask for the cache line at an address, which will be read soon from an order that no hardware foresees."""

    def codegen(context, builder, signature, args):
        word = ir.IntType(32)
        pointer = builder.inttoptr(args[0], ir.IntType(8).as_pointer())
        kind = ir.FunctionType(ir.VoidType(), [pointer.type, word, word, word])
        function = builder.module.declare_intrinsic("llvm.prefetch", [pointer.type], kind)
        builder.call(function, [pointer, word(0), word(3), word(1)])  # a read, to all levels, of data
        return context.get_dummy_value()

    return types.void(types.int64), codegen


@intrinsic
def float_bits(typingctx, value):
    """The 32 bits of a value as float32, as a non-negative int64."""

    def codegen(context, builder, signature, args):
        single = builder.fptrunc(args[0], ir.FloatType())
        return builder.zext(builder.bitcast(single, ir.IntType(32)), ir.IntType(64))

    return types.int64(types.float64), codegen


@intrinsic
def bits_float(typingctx, bits):
    """The float32 that the low 32 bits of an int64 stand for, as float64."""

    def codegen(context, builder, signature, args):
        low = builder.trunc(args[0], ir.IntType(32))
        return builder.fpext(builder.bitcast(low, ir.FloatType()), ir.DoubleType())

    return types.float64(types.int64), codegen


@intrinsic
def record_address(typingctx, record):
    """The address of a record reference."""

    def codegen(context, builder, signature, args):
        return builder.ptrtoint(args[0], ir.IntType(64))

    return types.int64(record), codegen


@intrinsic
def clear_record(typingctx, record):
    """Set all fields of a record to 0, by a reference to it."""

    def codegen(context, builder, signature, args):
        pointer = builder.bitcast(args[0], ir.IntType(8).as_pointer())
        _memset(builder, pointer, ir.Constant(ir.IntType(64), record.size), 0)
        return context.get_dummy_value()

    return types.void(record), codegen


def _caller(result):
    @intrinsic
    def call(typingctx, function, a, b, c, d, e):
        def codegen(context, builder, signature, args):
            word = ir.IntType(64)
            kind = ir.FunctionType(word if result is types.int64 else ir.VoidType(), [word] * 5)
            value = builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
            return value if result is types.int64 else context.get_dummy_value()

        return result(*[types.int64] * 6), codegen

    return call


# Call the code at an address (jit.Entry.address) with five int64; what it returns, if it does.
call_entry, call_for_outcome = _caller(types.void), _caller(types.int64)


__all__ = [name for name in globals() if not name.startswith("_") and name not in ("ir", "np", "types", "inlined")]
