# SPDX-License-Identifier: Apache-2.0
"""Dense layers and Adam as compiled loops, for networks too small for a tensor library.

At the paper's batch of 16 a tensor library spends its time on calls, not on arithmetic. The
loops take four rows at a time, so that what is loaded serves four products. Sums may be
reordered by the compiler: results are repeatable, but not the last bit of any other order.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import reordering_kernel

Array = NDArray[np.float32]

ZERO = np.float32(0.0)
PART = 32


class Layer(NamedTuple):
    """A dense layer y = W x + b: weight (O, I), bias (O,)."""

    weight: Array
    bias: Array


@reordering_kernel
def layer_at(flat: Array, start: int, outputs: int, inputs: int) -> Layer:
    """Return the layer whose weight and then bias begin at `start` of a flat array, as views."""
    end = start + outputs * inputs
    return Layer(flat[start:end].reshape(outputs, inputs), flat[end : end + outputs])


@reordering_kernel
def forward(x: Array, layer: Layer, y: Array) -> None:
    """Write W x + b of each row of x (B, I) to y (B, O)."""
    w, b = layer
    rows, inputs = x.shape
    outputs = w.shape[0]
    whole_rows, whole_outputs = rows - rows % 4, outputs - outputs % 2
    for r in range(0, whole_rows, 4):
        for o in range(0, whole_outputs, 2):
            s0, s1, s2, s3 = ZERO, ZERO, ZERO, ZERO
            t0, t1, t2, t3 = ZERO, ZERO, ZERO, ZERO
            for i in range(inputs):
                w0, w1 = w[o, i], w[o + 1, i]
                x0, x1, x2, x3 = x[r, i], x[r + 1, i], x[r + 2, i], x[r + 3, i]
                s0, s1, s2, s3 = s0 + x0 * w0, s1 + x1 * w0, s2 + x2 * w0, s3 + x3 * w0
                t0, t1, t2, t3 = t0 + x0 * w1, t1 + x1 * w1, t2 + x2 * w1, t3 + x3 * w1
            y[r, o], y[r + 1, o] = s0 + b[o], s1 + b[o]
            y[r + 2, o], y[r + 3, o] = s2 + b[o], s3 + b[o]
            y[r, o + 1], y[r + 1, o + 1] = t0 + b[o + 1], t1 + b[o + 1]
            y[r + 2, o + 1], y[r + 3, o + 1] = t2 + b[o + 1], t3 + b[o + 1]
        for o in range(whole_outputs, outputs):
            for k in range(r, r + 4):
                y[k, o] = dot(x[k], w[o]) + b[o]
    for r in range(whole_rows, rows):
        for o in range(outputs):
            y[r, o] = dot(x[r], w[o]) + b[o]


@reordering_kernel
def dot(a: Array, b: Array) -> np.float32:
    """Return the scalar product of two vectors."""
    total = ZERO
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@reordering_kernel
def rectify(y: Array) -> None:
    """Replace negative values of y (B, O) by 0."""
    for r in range(y.shape[0]):
        for o in range(y.shape[1]):
            y[r, o] = max(y[r, o], ZERO)


@reordering_kernel
def rectify_backward(y: Array, gradient: Array) -> None:
    """Zero the gradient (B, O) where the rectified y (B, O) is not above 0."""
    for r in range(y.shape[0]):
        for o in range(y.shape[1]):
            if y[r, o] <= ZERO:
                gradient[r, o] = ZERO


@reordering_kernel
def add_product(a: Array, b: Array, c: Array) -> None:
    """Add the product of a (R, K) and b (K, I) to c (R, I).

    Two rows and four terms at a time; b in parts that stay in the nearest cache.
    """
    rows, terms = a.shape
    columns = b.shape[1]
    for start in range(0, terms, PART):
        end = min(start + PART, terms)
        whole = end - (end - start) % 4
        for r in range(0, rows - 1, 2):
            c0, c1 = c[r], c[r + 1]
            for k in range(start, whole, 4):
                p0, p1, p2, p3 = a[r, k], a[r, k + 1], a[r, k + 2], a[r, k + 3]
                q0, q1, q2, q3 = a[r + 1, k], a[r + 1, k + 1], a[r + 1, k + 2], a[r + 1, k + 3]
                for i in range(columns):
                    b0, b1, b2, b3 = b[k, i], b[k + 1, i], b[k + 2, i], b[k + 3, i]
                    c0[i] += p0 * b0 + p1 * b1 + p2 * b2 + p3 * b3
                    c1[i] += q0 * b0 + q1 * b1 + q2 * b2 + q3 * b3
            for k in range(whole, end):
                for i in range(columns):
                    c0[i] += a[r, k] * b[k, i]
                    c1[i] += a[r + 1, k] * b[k, i]
        if rows % 2:
            c0 = c[rows - 1]
            for k in range(start, end):
                for i in range(columns):
                    c0[i] += a[rows - 1, k] * b[k, i]


@reordering_kernel
def backward_weights(gradient: Array, x: Array, out: Layer) -> None:
    """Write the derivative by weight and bias, from that by y (B, O) and the input x (B, I)."""
    out.weight[:] = ZERO
    out.bias[:] = ZERO
    add_product(gradient.T, x, out.weight)
    for r in range(gradient.shape[0]):
        for o in range(gradient.shape[1]):
            out.bias[o] += gradient[r, o]


@reordering_kernel
def backward_input(gradient: Array, layer: Layer, out: Array) -> None:
    """Write the derivative by the input x (B, I), from that by y (B, O)."""
    out[:] = ZERO
    add_product(gradient, layer.weight, out)


class Adam(NamedTuple):
    """First and second moments of the gradient (P,) (Kingma and Ba 2015), and the step count."""

    mean: Array
    square: Array
    steps: NDArray[np.int64]


MEAN_DECAY = 0.9
SQUARE_DECAY = 0.999


@reordering_kernel
def adam_step(
    weights: Array, gradient: Array, adam: Adam, learning_rate: float, epsilon: float
) -> None:
    """Move the weights (P,) by one step of Adam against the gradient (P,)."""
    adam.steps[0] += 1
    steps = adam.steps[0]
    b1, b2 = np.float32(MEAN_DECAY), np.float32(SQUARE_DECAY)
    c1, c2 = np.float32(1.0 - MEAN_DECAY), np.float32(1.0 - SQUARE_DECAY)
    size = np.float32(learning_rate / (1.0 - MEAN_DECAY**steps))
    root = np.float32(1.0 / np.sqrt(1.0 - SQUARE_DECAY**steps))
    least = np.float32(epsilon)
    mean, square = adam.mean, adam.square
    for i in range(weights.shape[0]):
        g = gradient[i]
        mean[i] = b1 * mean[i] + c1 * g
        square[i] = b2 * square[i] + c2 * g * g
        weights[i] -= size * mean[i] / (np.sqrt(square[i]) * root + least)


@reordering_kernel
def mix(target: Array, source: Array, share: float) -> None:
    """Move the target (P,) towards the source (P,) by a share of the way."""
    rate = np.float32(share)
    for i in range(target.shape[0]):
        target[i] += rate * (source[i] - target[i])


@reordering_kernel
def shorten(vector: Array, longest: float) -> None:
    """Scale a vector down to length `longest` if it is longer."""
    length = np.sqrt(np.float64(dot(vector, vector)))
    if length > longest:
        scale = np.float32(longest / length)
        for i in range(vector.shape[0]):
            vector[i] *= scale
