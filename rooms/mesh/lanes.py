# ruff: noqa: ARG001 - the arguments of an operation serve its signature only
"""Sixteen boxes or eight triangles against one ray, in one step each.

Compilers do not vectorise such short loops by themselves, so the vector operations
are written out; LLVM splits them where a machine has narrower registers.
"""

from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

BOXES, TRIANGLES = 16, 8  # of 32 and 64 bits: one wide register each
NONE = 0x7FFFFFFF  # the largest int32, farther than any box
_WHOLE = ir.IntType(64)


class Lanes:
    """Builds vector operations of one width at one place in the code."""

    def __init__(self, context: Any, builder: Any, element: Any, width: int) -> None:
        self.context, self.builder = context, builder
        self.width, self.vector = width, ir.VectorType(element, width)
        self.name = f"llvm.fma.v{width}f{32 if element == ir.FloatType() else 64}"

    def pointer(self, kind: Any, array: Any, offset: Any) -> Any:
        """Return where a vector begins in the data of an array."""
        data = self.context.make_array(kind)(self.context, self.builder, array).data
        at = self.builder.gep(data, [offset])
        return self.builder.bitcast(at, self.vector.as_pointer())

    def load(self, kind: Any, array: Any, row: Any) -> Any:
        """Load row `row` of an array whose rows are one vector long."""
        where = self.builder.mul(row, ir.Constant(_WHOLE, self.width))
        return self.builder.load(self.pointer(kind, array, where), align=4)

    def store(self, kind: Any, array: Any, value: Any, row: Any = None) -> None:
        """Store a vector as row `row` of an array."""
        row = ir.Constant(_WHOLE, 0) if row is None else row
        start = self.builder.mul(row, ir.Constant(_WHOLE, self.width))
        where = self.pointer(kind, array, start)
        self.builder.store(value, where, align=4)

    def spread(self, scalar: Any) -> Any:
        """Return a scalar in all lanes."""
        if self.vector.element == ir.FloatType():
            scalar = self.builder.fptrunc(scalar, self.vector.element)
        empty = ir.Constant(self.vector, ir.Undefined)
        one = self.builder.insert_element(empty, scalar, ir.Constant(_WHOLE, 0))
        lanes = ir.VectorType(ir.IntType(32), self.width)
        return self.builder.shuffle_vector(
            one, empty, ir.Constant(lanes, [0] * self.width)
        )

    def number(self, value: float) -> Any:
        """Return a constant in all lanes."""
        return ir.Constant(self.vector, [value] * self.width)

    def fused(self, a: Any, b: Any, c: Any) -> Any:
        """Return a b + c."""
        kind = ir.FunctionType(self.vector, [self.vector] * 3)
        function = get_or_insert_function(self.builder.module, kind, self.name)
        return self.builder.call(function, [a, b, c])

    def larger(self, a: Any, b: Any) -> Any:
        """Return the larger of two vectors, lane by lane; b for NaN."""
        return self.builder.select(self.builder.fcmp_ordered(">", a, b), a, b)

    def smaller(self, a: Any, b: Any) -> Any:
        """Return the smaller of two vectors, lane by lane; b for NaN."""
        return self.builder.select(self.builder.fcmp_ordered("<", a, b), a, b)

    def bits(self, mask: Any) -> Any:
        """Return a mask as the bits of a whole number."""
        packed = self.builder.bitcast(mask, ir.IntType(self.width))
        return self.builder.zext(packed, _WHOLE)


def _boxes_hit(
    typingctx, nodes, node, signs, ix, iy, iz, ax, ay, az, limit, near
) -> Any:
    """Return a bit mask of the boxes of a node that a ray meets before `limit`.

    `nodes` has shape (N, 6, 16), float32: low x y z, high x y z. `signs` holds one
    bit per axis along which the ray goes down; i is 1/way, a is -origin/way. The
    distance to each box is written to `near`, float32. Single precision is enough:
    boxes are larger than what they hold.
    """
    number, whole = types.float64, types.int64
    signature = whole(nodes, whole, whole, *([number] * 7), near)

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes = Lanes(context, builder, ir.FloatType(), BOXES)
        enter, leave = _entered(lanes, sig.args[0], args)
        lanes.store(sig.args[-1], args[-1], enter)
        return lanes.bits(builder.fcmp_ordered("<=", enter, leave))

    return signature, build


def _entered(lanes: Lanes, kind: Any, args: Any) -> tuple[Any, Any]:
    """Return the distances at which a ray enters and leaves the boxes of a node."""
    builder = lanes.builder
    array, node, signs, *scalars = args[:10]
    first = builder.mul(node, ir.Constant(_WHOLE, 6))
    enter, leave = lanes.number(0.0), lanes.spread(scalars[6])
    for axis in range(3):
        bit = builder.lshr(signs, ir.Constant(_WHOLE, axis))
        bit = builder.and_(bit, ir.Constant(_WHOLE, 1))
        shift = builder.mul(bit, ir.Constant(_WHOLE, 3))
        low_row = builder.add(ir.Constant(_WHOLE, axis), shift)
        high_row = builder.sub(ir.Constant(_WHOLE, 2 * axis + 3), low_row)
        inverse = lanes.spread(scalars[axis])
        base = lanes.spread(scalars[3 + axis])
        low = lanes.load(kind, array, builder.add(first, low_row))
        high = lanes.load(kind, array, builder.add(first, high_row))
        enter = lanes.larger(lanes.fused(low, inverse, base), enter)
        leave = lanes.smaller(lanes.fused(high, inverse, base), leave)
    return enter, leave


class _Keys:
    """Sixteen whole numbers, distance and lane of a box in one, nearest first out.

    The bits of positive floats are ordered like the floats; the last four name the
    lane, which brings a box nearer by a millionth.
    """

    def __init__(self, context: Any, builder: Any, kind: Any, array: Any) -> None:
        self.builder, self.number = builder, ir.IntType(32)
        self.vector = ir.VectorType(self.number, BOXES)
        self.data = context.make_array(kind)(context, builder, array).data

    def all(self, value: int) -> Any:
        return ir.Constant(self.vector, [value] * BOXES)

    def place(self, row: Any) -> Any:
        at = self.builder.mul(row, ir.Constant(_WHOLE, BOXES))
        where = self.builder.gep(self.data, [at])
        return self.builder.bitcast(where, self.vector.as_pointer())

    def made(self, enter: Any, met: Any) -> Any:
        lanes = ir.Constant(self.vector, list(range(BOXES)))
        keys = self.builder.bitcast(enter, self.vector)
        keys = self.builder.and_(keys, self.all(NONE & ~(BOXES - 1)))
        return self.builder.select(met, self.builder.or_(keys, lanes), self.all(NONE))

    def taken(self, keys: Any, row: Any) -> Any:
        """Return the least of the keys and store the others."""
        builder, least, width = self.builder, keys, BOXES
        while width > 1:
            width //= 2
            lanes = ir.VectorType(self.number, width)
            low, high = (
                builder.shuffle_vector(
                    least, least, ir.Constant(lanes, list(range(k, k + width)))
                )
                for k in (0, width)
            )
            lower = builder.icmp_signed("<", low, high)
            least = builder.select(lower, low, high)
        least = builder.extract_element(least, ir.Constant(self.number, 0))
        empty = ir.Constant(self.vector, ir.Undefined)
        one = builder.insert_element(empty, least, ir.Constant(self.number, 0))
        spread = builder.shuffle_vector(one, empty, self.all(0))
        same = builder.icmp_signed("==", keys, spread)
        rest = builder.select(same, self.all(NONE), keys)
        builder.store(rest, self.place(row), align=4)
        return builder.zext(least, _WHOLE)


def _nearest_box(
    typingctx, nodes, node, signs, ix, iy, iz, ax, ay, az, limit, keys, row
) -> Any:
    """Return the key of the nearest box of a node that a ray meets before `limit`.

    Those of the others are written to a row of `keys`, int32. The last four bits of a
    key name the box, the rest is the distance to it, see `key_of`; `NONE` is no box.
    """
    number, whole = types.float64, types.int64
    signature = whole(nodes, whole, whole, *([number] * 7), keys, whole)

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes = Lanes(context, builder, ir.FloatType(), BOXES)
        enter, leave = _entered(lanes, sig.args[0], args)
        met = builder.fcmp_ordered("<=", enter, leave)
        keys = _Keys(context, builder, sig.args[-2], args[-2])
        return keys.taken(keys.made(enter, met), args[-1])

    return signature, build


def _next_box(typingctx, keys, row) -> Any:
    """Return the least of a row of keys and take it out of the row."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        keys = _Keys(context, builder, sig.args[0], args[0])
        waiting = builder.load(keys.place(args[1]), align=4)
        return keys.taken(waiting, args[1])

    return types.int64(keys, types.int64), build


def _key_of(typingctx, distance) -> Any:
    """Return a key that those of boxes nearer than a positive distance stay below."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        short = builder.fptrunc(args[0], ir.FloatType())
        key = builder.zext(builder.bitcast(short, ir.IntType(32)), _WHOLE)
        return builder.add(key, ir.Constant(_WHOLE, 2 * BOXES))

    return types.int64(types.float64), build


def _triangles_hit(
    typingctx, packs, pack, ox, oy, oz, wx, wy, wz, limit, near, place
) -> Any:
    """Return a bit mask of the triangles of a pack that a ray meets before `limit`.

    `packs` has shape (M, 13, 8): plane n, d; then the two barycentric coordinates
    as planes U, u; V, v; then k, 1 for triangles and 0 for parallelograms. Distances
    are written to row `place` of `near`.

    References
    ----------
    D. Baldwin, M. Weber, J. Computer Graphics Techniques 5(3), 39 (2016).
    """
    number, whole = types.float64, types.int64
    signature = whole(packs, whole, *([number] * 7), near, whole)

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes = Lanes(context, builder, ir.DoubleType(), TRIANGLES)
        array, pack_, *scalars, near_, place_ = args
        first = builder.mul(pack_, ir.Constant(_WHOLE, 13))
        row = [
            lanes.load(sig.args[0], array, builder.add(first, ir.Constant(_WHOLE, k)))
            for k in range(13)
        ]
        origin = [lanes.spread(value) for value in scalars[:3]]
        way = [lanes.spread(value) for value in scalars[3:6]]
        height, slope = row[3], lanes.number(0.0)
        for axis in range(3):
            minus = builder.fsub(lanes.number(0.0), origin[axis])
            height = lanes.fused(row[axis], minus, height)
            slope = lanes.fused(row[axis], way[axis], slope)
        distance = builder.fdiv(height, slope)
        pair = []
        for k in (4, 8):
            # at the origin, and per distance, while the division goes on
            here, change = row[k + 3], lanes.number(0.0)
            for axis in range(3):
                here = lanes.fused(row[k + axis], origin[axis], here)
                change = lanes.fused(row[k + axis], way[axis], change)
            pair.append(lanes.fused(distance, change, here))
        u, v = pair
        rim = lanes.number(-1e-9)
        inside = builder.fcmp_ordered(">=", lanes.smaller(u, v), rim)
        # both are u + v for triangles, u and v for parallelograms
        rest = lanes.larger(lanes.fused(row[12], u, v), lanes.fused(row[12], v, u))
        below = builder.fcmp_ordered("<=", rest, lanes.number(1.0 + 1e-9))
        ahead = builder.fcmp_ordered(">", distance, lanes.number(0.0))
        close = builder.fcmp_ordered("<", distance, lanes.spread(scalars[6]))
        mask = builder.and_(builder.and_(inside, below), builder.and_(ahead, close))
        lanes.store(sig.args[-2], near_, distance, place_)
        return lanes.bits(mask)

    return signature, build


def _lowest_bit(typingctx: Any, mask: Any) -> Any:
    """Return the place of the lowest bit that is set."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return builder.cttz(args[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), build


# checkers see the builders, compiled code the operations
boxes_hit: Any = intrinsic(_boxes_hit)
nearest_box: Any = intrinsic(_nearest_box)
next_box: Any = intrinsic(_next_box)
key_of: Any = intrinsic(_key_of)
triangles_hit: Any = intrinsic(_triangles_hit)
lowest_bit: Any = intrinsic(_lowest_bit)
