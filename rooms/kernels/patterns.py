"""Evaluate gain patterns inside compiled loops."""

from numba import njit

from rir.harmonics_kernel import order_of, turned_harmonics


@njit(cache=True, nogil=True)
def pattern_gains(turn, coefficients, ux, uy, uz, basis, out):
    """Write the gain of each band towards a room direction into `out`.

    `basis` takes the harmonics of the direction in the device's frame.
    """
    lanes, count = coefficients.shape
    order = order_of(count)
    turned_harmonics(turn, ux, uy, uz, order, basis)
    out[:] = 0.0
    for m in range(order + 1):
        for degree in range(m, order + 1):
            center = degree * degree + degree
            for lane in range(lanes):
                out[lane] += coefficients[lane, center + m] * basis[center + m]
                if m:
                    out[lane] += coefficients[lane, center - m] * basis[center - m]
