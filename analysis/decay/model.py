"""Decay plus steady noise, fitted to block energies by maximum likelihood.

Block means mu_k of a noise-like response are gamma distributed around
m_k = sum_i A_i exp(-b_i t_k) + N. Minimising sum(mu/m + ln m) is solved by Fisher
scoring on the logarithms of the parameters, at most two decays and the noise.
"""

import numpy as np
from numba import njit

__all__ = ["block_means", "crossing", "improve", "level_at", "tail_after"]

FAST = {"reassoc", "contract", "nsz"}
PARAMETERS = 5
"""ln N, ln A_1, ln b_1, ln A_2, ln b_2; absent parts are -inf."""
NOTHING = -np.inf


@njit(cache=True, nogil=True, fastmath=FAST)
def block_means(energy, start, stop, count, means):
    """Fill `means` with the means of `count` equal blocks; return their width."""
    width = max((stop - start) // count, 1)
    for block in range(count):
        first = start + block * width
        total = 0.0
        for n in range(first, min(first + width, stop)):
            total += energy[n]
        means[block] = total / width
    return width


@njit(cache=True, nogil=True)
def solve(matrix, vector, size):
    """Solve a small symmetric system in place by elimination with pivots."""
    for column in range(size):
        pivot = column
        for row in range(column + 1, size):
            if abs(matrix[row, column]) > abs(matrix[pivot, column]):
                pivot = row
        if matrix[pivot, column] == 0.0:
            return False
        if pivot != column:
            for k in range(size):
                matrix[column, k], matrix[pivot, k] = (
                    matrix[pivot, k],
                    matrix[column, k],
                )
            vector[column], vector[pivot] = vector[pivot], vector[column]
        for row in range(column + 1, size):
            factor = matrix[row, column] / matrix[column, column]
            for k in range(column, size):
                matrix[row, k] -= factor * matrix[column, k]
            vector[row] -= factor * vector[column]
    for column in range(size - 1, -1, -1):
        for k in range(column + 1, size):
            vector[column] -= matrix[column, k] * vector[k]
        vector[column] /= matrix[column, column]
    return True


@njit(cache=True, nogil=True)
def level_at(theta, time):
    """Return the mean square of the decays, without noise, at a time."""
    level = np.exp(theta[1] - np.exp(theta[2]) * time)
    if theta[3] > NOTHING:
        level += np.exp(theta[3] - np.exp(theta[4]) * time)
    return level


@njit(cache=True, nogil=True)
def tail_after(theta, time):
    """Return the energy of the decays after a time."""
    rate = np.exp(theta[2])
    energy = np.exp(theta[1] - rate * time) / rate
    if theta[3] > NOTHING:
        rate = np.exp(theta[4])
        energy += np.exp(theta[3] - rate * time) / rate
    return energy


@njit(cache=True, nogil=True)
def crossing(theta, end):
    """Return when the decays meet the noise, at most `end`; 0 if never above it."""
    noise = np.exp(theta[0])
    if level_at(theta, end) >= noise:
        return end
    if level_at(theta, 0.0) <= noise:
        return 0.0
    low, high = 0.0, end
    for _ in range(60):
        middle = 0.5 * (low + high)
        if level_at(theta, middle) > noise:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, nogil=True)
def slopes_of_model(theta, time, slopes):
    """Fill the derivatives by each parameter; return the model's value."""
    value = 0.0
    slopes[0] = np.exp(theta[0])
    value += slopes[0]
    for part in range(2):
        a, b = 1 + 2 * part, 2 + 2 * part
        if theta[a] > NOTHING:
            rate = np.exp(theta[b])
            slopes[a] = np.exp(theta[a] - rate * time)
            slopes[b] = -rate * time * slopes[a]
            value += slopes[a]
    return value


@njit(cache=True, nogil=True)
def score(theta, means, used, first, count, free, matrix, vector):
    """Fill the scoring equations of the free parameters; return the deviance.

    The deviance is 2 sum(ln m + mu/m) over the used blocks.
    """
    matrix[:] = 0.0
    vector[:] = 0.0
    slopes = np.zeros(PARAMETERS)
    size = len(free)
    noise = np.exp(theta[0])
    fast, slow = np.exp(theta[2]), np.exp(theta[4])
    one = np.exp(theta[1] - fast * (first + 0.5))
    two = np.exp(theta[3] - slow * (first + 0.5)) if theta[3] > NOTHING else 0.0
    keep_one, keep_two = np.exp(-fast), np.exp(-slow)
    total = 0.0
    for k in range(first, count):
        if used[k]:
            value = noise + one + two
            time = k + 0.5
            slopes[0] = noise / value
            slopes[1] = one / value
            slopes[2] = -fast * time * slopes[1]
            slopes[3] = two / value
            slopes[4] = -slow * time * slopes[3]
            residual = means[k] / value - 1.0
            total += np.log(value) + residual
            for i in range(size):
                left = slopes[free[i]]
                vector[i] += left * residual
                for j in range(i + 1):
                    matrix[i, j] += left * slopes[free[j]]
        one *= keep_one
        two *= keep_two
    for i in range(size):
        matrix[i, i] = matrix[i, i] * (1.0 + 1e-9) + 1e-12
        for j in range(i):
            matrix[j, i] = matrix[i, j]
    return 2.0 * total


@njit(cache=True, nogil=True)
def improve(theta, means, used, first, count, free):
    """Iterate Fisher scoring in place with step halving; return the deviance."""
    matrix = np.zeros((PARAMETERS, PARAMETERS))
    step, size = np.zeros(PARAMETERS), len(free)
    kept = theta.copy()
    best = score(theta, means, used, first, count, free, matrix, step)
    for _ in range(30):
        if not solve(matrix, step, size):
            break
        largest = 0.0
        for i in range(size):
            largest = max(largest, abs(step[i]))
        scale = min(1.0, 1.5 / largest) if largest > 0.0 else 1.0
        moves = step.copy()
        value = np.inf
        for _half in range(8):
            for i in range(size):
                theta[free[i]] = kept[free[i]] + scale * moves[i]
            value = score(theta, means, used, first, count, free, matrix, step)
            if value <= best:
                break
            scale *= 0.5
        if not value <= best:
            theta[:] = kept
            break
        gain, best = best - value, value
        kept[:] = theta
        if gain < 1e-8 * count:
            break
    return best
