"""Reading MuJoCo's C structs inside compiled callbacks: typed pointers from addresses."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import extending, int64, njit, types

intrinsic: Any = extending.intrinsic  # compiled calls do not have its Python signature

CFunction = Any  # a ctypes function pointer
TAG = 20120595.0  # marks what is ours in a model: the paper's year and first page
COUPLED_TAG = TAG + 0.5  # the same, for springs whose law sees all springs
WORDS = types.CPointer(types.int64)  # mjModel and mjData as callbacks get them


@intrinsic
def doubles(typingctx: Any, address: Any) -> Any:
    """A pointer to float64 from an integer address."""
    return types.CPointer(types.float64)(types.int64), _int_to_pointer(ir.DoubleType())


@intrinsic
def integer_words(typingctx: Any, address: Any) -> Any:
    """A pointer to int64 from an integer address."""
    return types.CPointer(types.int64)(types.int64), _int_to_pointer(ir.IntType(64))


@intrinsic
def integers(typingctx: Any, address: Any) -> Any:
    """A pointer to int32 from an integer address."""
    return types.CPointer(types.int32)(types.int64), _int_to_pointer(ir.IntType(32))


@intrinsic
def address_of(typingctx: Any, words: Any) -> Any:
    """The address of a struct as an integer."""

    def codegen(context, builder, signature, args):
        return builder.ptrtoint(args[0], ir.IntType(64))

    return types.int64(WORDS), codegen


@intrinsic
def call_pull(typingctx, address, x1, x2, k1, k3, d1, d3):
    """Call the compiled spring law at an address."""

    def codegen(context, builder, signature, args):
        double = ir.DoubleType()
        function = ir.FunctionType(double, [double] * 6)
        return builder.call(builder.inttoptr(args[0], function.as_pointer()), args[1:])

    return types.float64(types.int64, *[types.float64] * 6), codegen


@intrinsic
def call_coupled(typingctx, law, x1, x2, user, count, width, pull):
    """Call the compiled coupled law at an address; all arrays as addresses."""

    def codegen(context, builder, signature, args):
        word = ir.IntType(64)
        function = ir.FunctionType(ir.VoidType(), [word] * 6)
        builder.call(builder.inttoptr(args[0], function.as_pointer()), args[1:])
        return context.get_dummy_value()

    return types.none(*[types.int64] * 7), codegen


@intrinsic
def call_step(typingctx, function, model, data):
    """Call MuJoCo's mj_step, or another void function of a model and its data; all addresses."""

    def codegen(context, builder, signature, args):
        word = ir.IntType(64)
        step = ir.FunctionType(ir.VoidType(), [word, word])
        builder.call(builder.inttoptr(args[0], step.as_pointer()), args[1:])
        return context.get_dummy_value()

    return types.none(types.int64, types.int64, types.int64), codegen


def _int_to_pointer(element: ir.Type) -> Callable:
    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], element.as_pointer())

    return codegen


@njit(cache=True)
def find_numeric(model, at, tag, least):
    """Where the custom numeric that begins with a tag starts, and its size, at least `least`.

    -1 and 0 without one. `at` has the offsets of nnumeric, numeric_adr, ..; nothing beyond the
    model's own numbers is read.
    """
    addresses, sizes = integers(model[at.numeric_adr]), integers(model[at.numeric_size])
    values = doubles(model[at.numeric_data])
    for i in range(model[at.nnumeric]):
        last = model[at.nnumericdata] - sizes[i]
        fits = sizes[i] >= least and 0 <= addresses[i] <= last
        if fits and values[addresses[i]] == tag:
            return int64(addresses[i]), int64(sizes[i])
    return int64(-1), int64(0)


@njit(cache=True)
def whole(value, end):
    """The whole part of a number of a model if it is from 0 to end - 1, else -1; NaN is not."""
    return int64(value) if 0.0 <= value < end else -1
