"""Short SIMD vectors for numba: types `double2`, `double4` with + - *, and row operations.

numba leaves LLVM's superword vectoriser off, and its loop vectoriser re-checks aliasing at
every loop entry, which costs as much as a small body's step. Saying what is a vector gives
one instruction where the source shows one. Indices count float64 elements from the start of
a flat contiguous array; nothing is bounds-checked.
"""

import operator

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

# Fusing multiply and add; nothing that changes NaN or infinity, or the order of a sum.
FLAGS = ("contract",)


class Vector(types.Type):
    """`width` float64 side by side in one register."""

    def __init__(self, width):
        self.width = width
        super().__init__(name=f"double{width}")

    def llvm(self):
        """The vector's LLVM type."""
        return ir.VectorType(ir.DoubleType(), self.width)


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager, vector):
        super().__init__(manager, vector, vector.llvm())


double2, double4 = Vector(2), Vector(4)


def _define(operation, instruction):
    """Element-wise vector-vector arithmetic, as one LLVM instruction."""

    class Arithmetic(ConcreteTemplate):
        cases = tuple(signature(v, v, v) for v in (double2, double4))

    def lower(context, builder, sig, args):
        return getattr(builder, instruction)(*args, flags=FLAGS)

    infer_global(operation)(Arithmetic)
    for vector in (double2, double4):
        lower_builtin(operation, vector, vector)(lower)


for _operation, _instruction in (
    (operator.add, "fadd"),
    (operator.iadd, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _define(_operation, _instruction)


def _pointer(context, builder, array_type, array, at, vector):
    """Where a vector starting at element `at` of a flat array lies."""
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), vector.llvm().as_pointer())


def _loader(vector):
    @intrinsic
    def load(typingctx, array, at):
        def generate(context, builder, sig, args):
            pointer = _pointer(context, builder, sig.args[0], *args, vector)
            return builder.load(pointer, align=8)

        return vector(array, at), generate

    return load


def _splatter(vector):
    @intrinsic
    def splat(typingctx, scalar):
        def generate(context, builder, sig, args):
            value = ir.Constant(vector.llvm(), ir.Undefined)
            for lane in range(vector.width):
                place = ir.Constant(ir.IntType(32), lane)
                value = builder.insert_element(value, args[0], place)
            return value

        return vector(types.float64), generate

    return splat


load2, load4 = _loader(double2), _loader(double4)  # load(array, at): array[at:at+width]
splat2, splat4 = _splatter(double2), _splatter(double4)  # splat(x): (x, x, ..)


@intrinsic
def store(typingctx, array, at, value):
    """array[at:at+width] = value."""

    def generate(context, builder, sig, args):
        pointer = _pointer(context, builder, sig.args[0], args[0], args[1], sig.args[2])
        builder.store(args[2], pointer, align=8)
        return context.get_dummy_value()

    return types.void(array, at, value), generate


@intrinsic
def square_root(typingctx, value):
    """Element-wise, correctly rounded."""

    def generate(context, builder, sig, args):
        kind = ir.FunctionType(value.llvm(), [value.llvm()])
        name = f"llvm.sqrt.v{value.width}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args)

    return value(value), generate


@intrinsic
def largest(typingctx, first, second):
    """Element-wise maximum; a NaN gives way to a number."""

    def generate(context, builder, sig, args):
        vector = first.llvm()
        kind = ir.FunctionType(vector, [vector, vector])
        name = f"llvm.maxnum.v{first.width}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args)

    return first(first, second), generate


@intrinsic(prefer_literal=True)
def lane(typingctx, value, index):
    """Element `index` (a literal) of a vector."""
    place = index.literal_value

    def generate(context, builder, sig, args):
        return builder.extract_element(args[0], ir.Constant(ir.IntType(32), place))

    return types.float64(value, index), generate


def _shuffle(builder, first, second, order):
    mask = ir.Constant(ir.VectorType(ir.IntType(32), len(order)), list(order))
    return builder.shuffle_vector(first, second, mask)


def _rearranger(name, result, order):
    """Intrinsic taking two vectors of one type, giving the elements `order` of both."""

    def rearrange(typingctx, first, second):
        def generate(context, builder, sig, args):
            return _shuffle(builder, *args, order)

        return result(first, second), generate

    rearrange.__name__ = rearrange.__qualname__ = name
    return intrinsic(rearrange)


# of (a, b, c, d) and (e, f, g, h), each one instruction: (a, e, c, g) and (b, f, d, h)
unpack_low = _rearranger("unpack_low", double4, (0, 4, 2, 6))
unpack_high = _rearranger("unpack_high", double4, (1, 5, 3, 7))
# the same, in reading order, for where speed matters less: (a, e, b, f) and (c, g, d, h)
interleave_low = _rearranger("interleave_low", double4, (0, 4, 1, 5))
interleave_high = _rearranger("interleave_high", double4, (2, 6, 3, 7))
# (a, b, e, f) and (c, d, g, h)
halves_low = _rearranger("halves_low", double4, (0, 1, 4, 5))
halves_high = _rearranger("halves_high", double4, (2, 3, 6, 7))
join = _rearranger("join", double4, (0, 1, 2, 3))  # two double2 -> one double4
