"""Eight boxes or eight triangles against one ray, in one step each.

Compilers do not vectorise such short loops by themselves, so the vector operations
are written out; LLVM splits them where a machine has narrower registers.
"""

from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

LANES = 8
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, LANES)


class _Lanes:
    """Builds vector operations on one code position."""

    def __init__(self, context: Any, builder: Any) -> None:
        self.context, self.builder = context, builder

    def pointer(self, kind: Any, array: Any, offset: Any) -> Any:
        data = self.context.make_array(kind)(self.context, self.builder, array).data
        at = self.builder.gep(data, [offset])
        return self.builder.bitcast(at, _VECTOR.as_pointer())

    def load(self, kind: Any, array: Any, first: Any, row: Any) -> Any:
        """Load row `row` of the table that starts `first` rows into an array."""
        eight = ir.Constant(ir.IntType(64), LANES)
        rows = self.builder.add(first, row)
        where = self.pointer(kind, array, self.builder.mul(rows, eight))
        return self.builder.load(where, align=8)

    def store(self, kind: Any, array: Any, value: Any) -> None:
        zero = ir.Constant(ir.IntType(64), 0)
        self.builder.store(value, self.pointer(kind, array, zero), align=8)

    def spread(self, scalar: Any) -> Any:
        empty = ir.Constant(_VECTOR, ir.Undefined)
        zero = ir.Constant(ir.IntType(32), 0)
        one = self.builder.insert_element(empty, scalar, zero)
        mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return self.builder.shuffle_vector(one, empty, mask)

    def number(self, value: float) -> Any:
        return ir.Constant(_VECTOR, [value] * LANES)

    def fused(self, a: Any, b: Any, c: Any) -> Any:
        """Return a b + c."""
        kind = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
        name = f"llvm.fma.v{LANES}f64"
        function = get_or_insert_function(self.builder.module, kind, name)
        return self.builder.call(function, [a, b, c])

    def larger(self, a: Any, b: Any) -> Any:
        return self.builder.select(self.builder.fcmp_ordered(">", a, b), a, b)

    def smaller(self, a: Any, b: Any) -> Any:
        return self.builder.select(self.builder.fcmp_ordered("<", a, b), a, b)

    def bits(self, mask: Any) -> Any:
        byte = self.builder.bitcast(mask, ir.IntType(LANES))
        return self.builder.zext(byte, ir.IntType(64))


@intrinsic
def boxes_hit(
    typingctx, nodes, node, signs, ix, iy, iz, ax, ay, az, limit, near
):  # numpydoc ignore=PR01
    """Return a bit mask of the boxes of a node that a ray meets before `limit`.

    `nodes` has shape (N, 6, 8): low x y z, high x y z. `signs` holds one bit per
    axis along which the ray goes down; i is 1/way, a is -origin/way. The distance
    to each box is written to `near`.
    """
    number, whole = types.float64, types.int64
    signature = whole(nodes, whole, whole, *([number] * 7), near)

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes = _Lanes(context, builder)
        array, node_, signs_, *scalars, near_ = args
        integer = ir.IntType(64)
        first = builder.mul(node_, ir.Constant(integer, 6))
        enter, leave = lanes.number(0.0), lanes.spread(scalars[6])
        for axis in range(3):
            bit = builder.lshr(signs_, ir.Constant(integer, axis))
            bit = builder.and_(bit, ir.Constant(integer, 1))
            three, place = ir.Constant(integer, 3), ir.Constant(integer, axis)
            low_row = builder.add(place, builder.mul(bit, three))
            high_row = builder.sub(ir.Constant(integer, 2 * axis + 3), low_row)
            inverse = lanes.spread(scalars[axis])
            shift = lanes.spread(scalars[3 + axis])
            low = lanes.load(sig.args[0], array, first, low_row)
            high = lanes.load(sig.args[0], array, first, high_row)
            enter = lanes.larger(lanes.fused(low, inverse, shift), enter)
            leave = lanes.smaller(lanes.fused(high, inverse, shift), leave)
        lanes.store(sig.args[-1], near_, enter)
        return lanes.bits(builder.fcmp_ordered("<=", enter, leave))

    return signature, build


@intrinsic
def triangles_hit(
    typingctx, packs, pack, ox, oy, oz, wx, wy, wz, limit, near
):  # numpydoc ignore=PR01
    """Return a bit mask of the triangles of a pack that a ray meets before `limit`.

    `packs` has shape (M, 12, 8): plane n, d; then the two barycentric coordinates
    as planes U, u; V, v. Distances are written to `near`.

    References
    ----------
    D. Baldwin, M. Weber, J. Computer Graphics Techniques 5(3), 39 (2016).
    """
    number, whole = types.float64, types.int64
    signature = whole(packs, whole, *([number] * 7), near)

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        lanes = _Lanes(context, builder)
        array, pack_, *scalars, near_ = args
        integer = ir.IntType(64)
        first = builder.mul(pack_, ir.Constant(integer, 12))
        row = [
            lanes.load(sig.args[0], array, first, ir.Constant(integer, k))
            for k in range(12)
        ]
        origin = [lanes.spread(value) for value in scalars[:3]]
        way = [lanes.spread(value) for value in scalars[3:6]]
        height, slope = row[3], lanes.number(0.0)
        for axis in range(3):
            minus = builder.fsub(lanes.number(0.0), origin[axis])
            height = lanes.fused(row[axis], minus, height)
            slope = lanes.fused(row[axis], way[axis], slope)
        distance = builder.fdiv(height, slope)
        point = [lanes.fused(distance, w, o) for o, w in zip(origin, way, strict=True)]
        u, v = row[7], row[11]
        for axis in range(3):
            u = lanes.fused(row[4 + axis], point[axis], u)
            v = lanes.fused(row[8 + axis], point[axis], v)
        rim = lanes.number(-1e-9)
        inside = builder.fcmp_ordered(">=", lanes.smaller(u, v), rim)
        rest = builder.fadd(u, v)
        below = builder.fcmp_ordered("<=", rest, lanes.number(1.0 + 1e-9))
        ahead = builder.fcmp_ordered(">", distance, lanes.number(0.0))
        close = builder.fcmp_ordered("<", distance, lanes.spread(scalars[6]))
        mask = builder.and_(builder.and_(inside, below), builder.and_(ahead, close))
        lanes.store(sig.args[-1], near_, distance)
        return lanes.bits(mask)

    return signature, build


@intrinsic
def lowest_bit(typingctx, mask):  # numpydoc ignore=PR01
    """Return the place of the lowest bit that is set."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return builder.cttz(args[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), build
