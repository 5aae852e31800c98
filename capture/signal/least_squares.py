"""Small least squares without BLAS: its threads may cost a second on a busy machine."""

import numpy as np

from rir.arrays import FloatArray

__all__ = ["least_squares"]


def least_squares(matrix: FloatArray, right: FloatArray, smallest: float) -> FloatArray:
    """Solve an overdetermined system by Householder reflections.

    Parameters
    ----------
    matrix : ndarray, shape (m, n)
        One row per equation.
    right : ndarray, shape (m,)
        Right side.
    smallest : float
        Directions weaker than this share of the matrix's largest column are not
        followed.

    Returns
    -------
    ndarray, shape (n,)

    References
    ----------
    Golub and Van Loan, Matrix Computations (2013), section 5.3.

    Examples
    --------
    >>> rows = np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]])
    >>> least_squares(rows, np.array([1.0, 3.0, 5.0]), 1e-12).round(9).tolist()
    [1.0, 2.0]
    """
    m, n = matrix.shape
    scale = smallest * float(np.sqrt(np.max(np.einsum("ij,ij->j", matrix, matrix))))
    # The right side rides along as the last column; the rows below hold the solution
    # small where nothing determines it.
    work = np.zeros((n + 1, m + n))
    work[:n, :m], work[n, :m] = matrix.T, right
    work[np.arange(n), m + np.arange(n)] = scale
    for step in range(n):
        column = work[step, step:].copy()
        norm = float(np.sqrt(np.einsum("i,i->", column, column)))
        column[0] += np.copysign(norm, column[0])
        share = 2 / np.einsum("i,i->", column, column)
        rest = work[step:, step:]
        shadow = np.einsum("ji,i->j", rest, column)
        rest -= share * shadow[:, np.newaxis] * column
    solution = np.zeros(n)
    for step in reversed(range(n)):
        known = np.einsum("i,i->", work[step + 1 : n, step], solution[step + 1 :])
        solution[step] = (work[n, step] - known) / work[step, step]
    return solution
