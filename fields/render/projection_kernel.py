"""Compiled passes of the causal sum; see fields.render.projection."""

import numpy as np
from numba import njit

__all__ = ["sum_backward", "sum_forward"]


@njit(cache=True, fastmath=True)
def sum_forward(features, weights, shells, arrivals, delays, matrix, bias, order):
    """Walk forward in time; returns the response, shape (n_samples,)."""
    n_samples, width = matrix.shape
    count = len(delays)
    sums = np.zeros((count, width), dtype=np.float32)
    totals = np.zeros(count, dtype=np.float32)
    begun = np.zeros(count, dtype=np.bool_)
    response = np.zeros(n_samples, dtype=np.float32)
    following = 0
    for time in range(n_samples):
        while following < len(order) and arrivals[order[following]] <= time:
            point = order[following]
            shell = shells[point]
            share = weights[point]
            for k in range(width):
                sums[shell, k] += share * features[point, k]
            totals[shell] += share
            begun[shell] = True
            following += 1
        for shell in range(count):
            arrival = time + delays[shell]
            if begun[shell] and arrival < n_samples:
                value = np.float32(0.0)
                for k in range(width):
                    value += matrix[time, k] * sums[shell, k]
                response[arrival] += value + bias[time] * totals[shell]
    return response


@njit(cache=True, fastmath=True)
def sum_backward(
    features,
    weights,
    shells,
    arrivals,
    delays,
    matrix,
    bias,
    order,
    gradient,
):
    """Return gradients of features, weights, matrix and bias."""
    n_samples, width = matrix.shape
    count = len(delays)
    for_features = np.zeros_like(features)
    for_weights = np.zeros_like(weights)
    for_matrix = np.zeros_like(matrix)
    for_bias = np.zeros_like(bias)
    sums = np.zeros((count, width), dtype=np.float32)
    totals = np.zeros(count, dtype=np.float32)
    begun = np.zeros(count, dtype=np.bool_)
    following = 0
    for time in range(n_samples):
        while following < len(order) and arrivals[order[following]] <= time:
            point = order[following]
            shell = shells[point]
            for k in range(width):
                sums[shell, k] += weights[point] * features[point, k]
            totals[shell] += weights[point]
            begun[shell] = True
            following += 1
        for shell in range(count):
            arrival = time + delays[shell]
            if begun[shell] and arrival < n_samples:
                value = gradient[arrival]
                for k in range(width):
                    for_matrix[time, k] += value * sums[shell, k]
                for_bias[time] += value * totals[shell]
    # What a point's features do to all samples from its arrival on.
    later = np.zeros((count, width), dtype=np.float32)
    later_bias = np.zeros(count, dtype=np.float32)
    following = len(order) - 1
    for time in range(n_samples - 1, -1, -1):
        for shell in range(count):
            arrival = time + delays[shell]
            if begun[shell] and arrival < n_samples:
                value = gradient[arrival]
                for k in range(width):
                    later[shell, k] += value * matrix[time, k]
                later_bias[shell] += value * bias[time]
        while following >= 0 and arrivals[order[following]] >= time:
            point = order[following]
            if arrivals[point] == time:
                shell = shells[point]
                total = later_bias[shell]
                for k in range(width):
                    for_features[point, k] = weights[point] * later[shell, k]
                    total += later[shell, k] * features[point, k]
                for_weights[point] = total
            following -= 1
    return for_features, for_weights, for_matrix, for_bias
