# ruff: noqa: ARG001 - the arguments of an operation serve its signature only
"""Operations on rows of eight numbers: bands of a ray, or columns of a transform.

Compilers do not vectorise such short loops by themselves, see `rooms.mesh.lanes`.
Arrays are taken as rows of eight, whatever their shape. Products and sums are never
fused, so that exchanging two factors or summands changes nothing.
"""

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

from rooms.mesh.lanes import Lanes

WIDTH = 8  # doubles of one wide register
_WHOLE, _REAL = types.int64, types.float64


class _Rows:
    """Loads and stores the rows of the arrays of one operation as doubles."""

    def __init__(self, context: Any, builder: Any, kinds: Any) -> None:
        self.builder, self.kinds = builder, kinds
        self.wide = Lanes(context, builder, ir.DoubleType(), WIDTH)
        self.narrow = Lanes(context, builder, ir.FloatType(), WIDTH)

    def _short(self, which: int) -> bool:
        return self.kinds[which].dtype == types.float32

    def get(self, which: int, array: Any, row: Any) -> Any:
        kind = self.kinds[which]
        if self._short(which):
            value = self.narrow.load(kind, array, row)
            return self.builder.fpext(value, self.wide.vector)
        return self.wide.load(kind, array, row)

    def put(self, which: int, array: Any, value: Any, row: Any) -> None:
        kind = self.kinds[which]
        if self._short(which):
            value = self.builder.fptrunc(value, self.narrow.vector)
            self.narrow.store(kind, array, value, row)
        else:
            self.wide.store(kind, array, value, row)

    def complex(self, which: int, array: Any, row: Any) -> tuple[Any, Any]:
        real, imaginary = _halves(self.builder, row)
        return self.get(which, array, real), self.get(which, array, imaginary)

    def put_complex(self, which: int, array: Any, value: Any, row: Any) -> None:
        for part, place in zip(value, _halves(self.builder, row), strict=True):
            self.put(which, array, part, place)

    def times(self, one: Any, other: Any) -> tuple[Any, Any]:
        """Return the product of two complex rows."""
        b = self.builder
        (a, c), (d, e) = one, other
        real = b.fsub(b.fmul(a, d), b.fmul(c, e))
        return real, b.fadd(b.fmul(a, e), b.fmul(c, d))


def _halves(builder: Any, row: Any) -> tuple[Any, Any]:
    twice = builder.shl(row, ir.Constant(row.type, 1))
    return twice, builder.or_(twice, ir.Constant(row.type, 1))


def _operation(
    kinds: Sequence[Any], arguments: Sequence[Any], body: Callable[..., Any]
) -> tuple[Any, Any]:
    """Return signature and builder of an operation that returns nothing."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        body(_Rows(context, builder, sig.args), builder, *args)
        return context.get_dummy_value()

    return types.void(*kinds, *arguments), build


def _fill(typingctx, a, i, value) -> Any:
    """Set a[i] to a number."""

    def body(rows: _Rows, _: Any, a: Any, i: Any, value: Any) -> None:
        rows.put(0, a, rows.wide.spread(value), i)

    return _operation((a,), (_WHOLE, _REAL), body)


def _copy(typingctx, a, i, b, j) -> Any:
    """Set a[i] to b[j]."""

    def body(rows: _Rows, _: Any, a: Any, i: Any, b: Any, j: Any) -> None:
        rows.put(0, a, rows.get(2, b, j), i)

    return _operation((a, _WHOLE, b, _WHOLE), (), body)


def _add(typingctx, a, i, b, j, factor) -> Any:
    """Add a multiple of b[j] to a[i]."""

    def body(
        rows: _Rows, builder: Any, a: Any, i: Any, b: Any, j: Any, factor: Any
    ) -> None:
        more = builder.fmul(rows.get(2, b, j), rows.wide.spread(factor))
        rows.put(0, a, builder.fadd(rows.get(0, a, i), more), i)

    return _operation((a, _WHOLE, b, _WHOLE), (_REAL,), body)


def _scale(typingctx, a, i, b, j, factor, more) -> Any:
    """Multiply a[i] by factor b[j] + more."""

    def body(
        rows: _Rows,
        builder: Any,
        a: Any,
        i: Any,
        b: Any,
        j: Any,
        factor: Any,
        more: Any,
    ) -> None:
        wide = rows.wide
        by = wide.fused(rows.get(2, b, j), wide.spread(factor), wide.spread(more))
        rows.put(0, a, builder.fmul(rows.get(0, a, i), by), i)

    return _operation((a, _WHOLE, b, _WHOLE), (_REAL, _REAL), body)


def _product(typingctx, a, i, b, j) -> Any:
    """Return the sum of the products of a[i] and b[j]."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        rows = _Rows(context, builder, sig.args)
        a, i, b, j = args
        value = builder.fmul(rows.get(0, a, i), rows.get(2, b, j))
        half = WIDTH // 2
        while half:
            lanes = ir.VectorType(ir.IntType(32), half)
            parts = [
                builder.shuffle_vector(
                    value, value, ir.Constant(lanes, list(range(k, k + half)))
                )
                for k in (0, half)
            ]
            value, half = builder.fadd(*parts), half // 2
        return builder.extract_element(value, ir.Constant(ir.IntType(32), 0))

    return _REAL(a, _WHOLE, b, _WHOLE), build


def _pour(typingctx, a, i, b, j, c, first, second, d, row, one, other, by, also) -> Any:
    """Add to the complex rows a[i] and b[j] multiples of one that two rows of c make.

    It is d[row] times one c[first] + other c[second] + j other c[second], and gets
    multiplied by `by` for a and by `also` for b.
    """

    def body(rows: _Rows, builder: Any, *args: Any) -> None:
        a, i, b, j, c, first, second, d, row, one, other, by, also = args
        wide, root = rows.wide, rows.get(7, d, row)
        part = builder.fmul(rows.get(4, c, second), wide.spread(other))
        real = builder.fmul(rows.get(4, c, first), wide.spread(one))
        value = (
            builder.fmul(builder.fadd(real, part), root),
            builder.fmul(part, root),
        )
        for which, array, place, factor in ((0, a, i, by), (2, b, j, also)):
            scale, here = wide.spread(factor), rows.complex(which, array, place)
            pair = [
                builder.fadd(x, builder.fmul(y, scale))
                for x, y in zip(here, value, strict=True)
            ]
            rows.put_complex(which, array, pair, place)

    whole = (a, _WHOLE, b, _WHOLE, c, _WHOLE, _WHOLE, d, _WHOLE)
    return _operation(whole, (_REAL, _REAL, _REAL, _REAL), body)


def _meet(typingctx, a, i, b, j, c, k, factor) -> Any:
    """Add to the complex row a[i] a multiple of the product of b[j] and c[k]."""

    def body(rows: _Rows, builder: Any, *args: Any) -> None:
        a, i, b, j, c, k, factor = args
        wanted = rows.times(rows.complex(2, b, j), rows.complex(4, c, k))
        by, here = rows.wide.spread(factor), rows.complex(0, a, i)
        pair = [
            builder.fadd(x, builder.fmul(y, by))
            for x, y in zip(here, wanted, strict=True)
        ]
        rows.put_complex(0, a, pair, i)

    return _operation((a, _WHOLE, b, _WHOLE, c, _WHOLE), (_REAL,), body)


def _twist(typingctx, a, i, step, one, two, three, at, by, also) -> Any:
    """Transform four complex rows of `a`, `step` apart, and turn the last three.

    The turns are rows `at`, `by` and `also` of the tables `one`, `two`, `three`,
    shape (N, 2).
    """

    def body(rows: _Rows, builder: Any, *args: Any) -> None:
        b, (a, i, step, *tables) = builder, args
        places = [i]
        for _ in range(3):
            places.append(b.add(places[-1], step))
        w, x, y, z = (rows.complex(0, a, place) for place in places)
        even, odd = _butterfly(b, w, y), _butterfly(b, x, z)
        # a quarter turn back: -i (x - z)
        quarter = odd[1][1], b.fneg(odd[1][0])
        first, third = _butterfly(b, even[0], odd[0])
        second, fourth = _butterfly(b, even[1], quarter)
        rows.put_complex(0, a, first, places[0])
        turned = zip((second, third, fourth), range(3), places[1:], strict=True)
        for value, n, place in turned:
            turn = _turn(rows, rows.kinds[3 + n], tables[n], tables[3 + n])
            rows.put_complex(0, a, rows.times(value, turn), place)

    return _operation(
        (a, _WHOLE, _WHOLE, one, two, three), (_WHOLE, _WHOLE, _WHOLE), body
    )


def _turn(rows: _Rows, kind: Any, table: Any, row: Any) -> tuple[Any, Any]:
    data = rows.wide.context.make_array(kind)(
        rows.wide.context, rows.builder, table
    ).data
    real, imaginary = (
        rows.wide.spread(rows.builder.load(rows.builder.gep(data, [place])))
        for place in _halves(rows.builder, row)
    )
    return real, imaginary


def _butterfly(builder: Any, one: Any, other: Any) -> tuple[Any, Any]:
    pairs = list(zip(one, other, strict=True))
    return (
        tuple(builder.fadd(x, y) for x, y in pairs),
        tuple(builder.fsub(x, y) for x, y in pairs),
    )


def _halve(typingctx, a, i) -> Any:
    """Transform two neighbouring complex rows of `a`."""

    def body(rows: _Rows, builder: Any, a: Any, i: Any) -> None:
        j = builder.add(i, ir.Constant(i.type, 1))
        both = _butterfly(builder, rows.complex(0, a, i), rows.complex(0, a, j))
        for value, place in zip(both, (i, j), strict=True):
            rows.put_complex(0, a, value, place)

    return _operation((a, _WHOLE), (), body)


# checkers see the builders, compiled code the operations
fill: Any = intrinsic(_fill)
copy: Any = intrinsic(_copy)
add: Any = intrinsic(_add)
scale: Any = intrinsic(_scale)
product: Any = intrinsic(_product)
pour: Any = intrinsic(_pour)
meet: Any = intrinsic(_meet)
twist: Any = intrinsic(_twist)
halve: Any = intrinsic(_halve)
