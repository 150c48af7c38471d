"""Interpolation of rows of four float32 by vector instructions, for Numba kernels.

Numba's compiler makes vector instructions of loops alone, not of the few numbers of one interpolation; so the
instructions are written here, as LLVM has them for every processor.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_FLAGS = ("fast",)
_INT = ir.IntType(32)


def _repeated(builder: Any, value: Any, count: int) -> Any:
    """A vector of `count` times a float."""
    vector = ir.VectorType(ir.FloatType(), count)
    first = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_INT, 0))
    order = ir.Constant(ir.VectorType(_INT, count), [0] * count)
    return builder.shuffle_vector(first, ir.Constant(vector, ir.Undefined), order)


def _half(builder: Any, row: Any, first: int) -> Any:
    """Four of a vector of eight, from the first."""
    order = ir.Constant(ir.VectorType(_INT, 4), [first, first + 1, first + 2, first + 3])
    return builder.shuffle_vector(row, ir.Constant(row.type, ir.Undefined), order)


@intrinsic
def blend_pairs(typing_context: Any, grid: Any, starts: Any, weights: Any, share: Any) -> Any:
    """First three numbers of (1 - share) A + share B, where the weighted sum of pairs of rows is (A, B).

    grid: float32, contiguous; starts: n numbers of elements (uintp) from which 8, a pair of rows of four, are
    taken; weights: n of them, share: float32. With pairs along x, trilinear interpolation has n = 4, bilinear
    n = 2.
    """
    signature = types.UniTuple(types.float32, 3)(grid, starts, weights, share)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, args[0])
        pair = ir.VectorType(ir.FloatType(), 8).as_pointer()
        total = None
        for n in range(signature.args[1].count):
            at = builder.gep(array.data, [builder.extract_value(args[1], n)])
            row = builder.load(builder.bitcast(at, pair), align=4)
            weight = _repeated(builder, builder.extract_value(args[2], n), 8)
            term = builder.fmul(row, weight, flags=_FLAGS)
            total = term if total is None else builder.fadd(total, term, flags=_FLAGS)
        low, high = _half(builder, total, 0), _half(builder, total, 4)
        change = builder.fmul(builder.fsub(high, low, flags=_FLAGS), _repeated(builder, args[3], 4))
        blended = builder.fadd(low, change, flags=_FLAGS)
        numbers = [builder.extract_element(blended, ir.Constant(_INT, n)) for n in range(3)]
        return cgutils.pack_array(builder, numbers)

    return signature, generate


@intrinsic
def blend_spline(typing_context: Any, points: Any, start: Any, line: Any, plane: Any, weights: Any) -> Any:
    """Value and slopes of a tensor product spline, 12 numbers: x(u), dx/du_0, dx/du_1, dx/du_2.

    points: float32, contiguous, rows of four; start, line, plane (uintp): the element of the first of the
    4 x 4 x 4 points, and how many elements further the next in u_1 and u_2 is; weights [3,9] float32,
    contiguous, as `lattice_flow.spline_weights` writes them.
    """
    signature = types.UniTuple(types.float32, 12)(points, start, line, plane, weights)

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, args[0])
        table = context.make_array(signature.args[4])(context, builder, args[4])
        pair = ir.VectorType(ir.FloatType(), 8)

        def weight(n: int) -> Any:
            return builder.load(builder.gep(table.data, [ir.Constant(ir.IntType(64), n)]))

        def both(n: int) -> Any:
            """Weights n and n + 1 of u_0, each for the four numbers of its point."""
            halves = [_repeated(builder, weight(m), 4) for m in (n, n + 1)]
            return builder.shuffle_vector(*halves, ir.Constant(ir.VectorType(_INT, 8), list(range(8))))

        def times(a: Any, b: Any, onto: Any = None) -> Any:
            product = builder.fmul(a, b, flags=_FLAGS)
            return product if onto is None else builder.fadd(onto, product, flags=_FLAGS)

        along = [both(n) for n in (0, 2, 4, 6)]
        ys, zs = ([_repeated(builder, weight(9 * a + n), 8) for n in range(8)] for a in (1, 2))
        value = by_x = by_y = by_z = None
        for c in range(4):
            sum_value = sum_x = sum_y = None
            for b in range(4):
                at = builder.add(args[1], builder.mul(args[2], ir.Constant(args[2].type, b)))
                at = builder.add(at, builder.mul(args[3], ir.Constant(args[3].type, c)))
                rows = []
                for n in (0, 8):
                    place = builder.add(at, ir.Constant(at.type, n))
                    pointer = builder.bitcast(builder.gep(array.data, [place]), pair.as_pointer())
                    rows.append(builder.load(pointer, align=4))
                here = times(along[1], rows[1], times(along[0], rows[0]))
                slope = times(along[3], rows[1], times(along[2], rows[0]))
                sum_value = times(ys[b], here, sum_value)
                sum_y = times(ys[4 + b], here, sum_y)
                sum_x = times(ys[b], slope, sum_x)
            value, by_z = times(zs[c], sum_value, value), times(zs[4 + c], sum_value, by_z)
            by_x, by_y = times(zs[c], sum_x, by_x), times(zs[c], sum_y, by_y)
        numbers = []
        for each in (value, by_x, by_y, by_z):
            whole = builder.fadd(_half(builder, each, 0), _half(builder, each, 4), flags=_FLAGS)
            numbers += [builder.extract_element(whole, ir.Constant(_INT, n)) for n in range(3)]
        return cgutils.pack_array(builder, numbers)

    return signature, generate
