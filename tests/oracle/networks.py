"""Neural moment transparency and deep fragments by their equations, in float64, from plain arrays.

Tsopouridis et al. 2024, sections 3 and 3.1; csrc/kernels/deep_fragments.h says what is ours. One
pixel: depths z in the unit range, any order.
"""

import numpy as np


def logistic(x):
    return 1 / (1 + np.exp(-np.clip(x, -700, 700)))


def said(network, features):
    """What a moit.Network says, layer by layer."""
    x = (np.asarray(features, float) - network.mean) / network.scale
    for i, (weights, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        x = x @ weights.astype(float).T + bias.astype(float)
        x = np.maximum(x, 0) if i < len(network.weights) - 1 else x
    return logistic(x[..., 0])


def half(x):
    return np.float64(np.float16(x))


def word(x):
    """Of [-1, 1], as unorm16 of [0, 1] holds it."""
    return 2 * np.floor((x + 1) / 2 * 65535 + 0.5) / 65535 - 1


def extent(z, pixel):
    held = word if pixel else half
    return held(z.min()), held(z.max())


def neural_features(z, absorbance, pixel, at=None):
    """(len(at), 7) of fragments at depths `at`, by default its own."""
    near, far = extent(z, pixel)
    at = z if at is None else at
    if pixel:

        def placed(x):
            if near == far:
                return np.zeros_like(x)
            return np.clip(2 * (x - near) / (far - near) - 1, -1, 1)

        z, at, near, far = placed(z), placed(at), -1.0 * (near < far), 1.0 * (near < far)
    d = np.zeros_like(at)
    if near < far:
        span = np.exp(far) - np.exp(near)
        d = np.clip((np.exp(at) - np.exp(near)) / span, 0, 1)
    sums = [(absorbance * z**k).sum() for k in range(5)]
    return np.column_stack([d, *(np.full(len(at), x) for x in (len(z), *sums))])


def neural(network, z, absorbance, pixel):
    """T of each fragment."""
    total = np.exp(-absorbance.sum())
    return np.maximum(said(network, neural_features(z, absorbance, pixel)), total)


class Deep:
    """A pixel of deep fragments: depths for the order, z in [0, 1], colours."""

    def __init__(self, network, depth, z, alpha, absorbance, color):
        order = np.argsort(depth, kind="stable")
        front, tail = order[:2], np.sort(order[2:])  # the tail as it arrived
        self.T = np.ones(len(z))
        self.T[front[1:]] = 1 - alpha[front[:1]]
        self.through = np.prod(1 - alpha[front])
        self.color = (self.T[front] * alpha[front]) @ color[front]
        self.total, self.features = self.through, None
        if not len(tail):
            return
        a, second, last = absorbance[tail], z[front[1]], half(z.max())
        v = np.clip((z[tail] - second) / (last - second), 0, 1) if last > second else 0 * a
        weighted = a * np.exp(-absorbance.sum() * v)
        near, near_color, all_color = 0.0, np.zeros(3), np.zeros(3)
        for i, k in enumerate(tail):  # render targets round each time
            near = half(near + weighted[i])
            near_color = half(near_color + weighted[i] * color[k])
            all_color = half(all_color + a[i] * color[k])
        left = a.sum()
        kept = min(near / left, 1) if left else 1
        ends = second - z[front[0]], max(last - second, 0)
        self.features = np.array([left, kept, np.exp(-left), *ends])
        share = float(said(network, self.features)) if near else 0.0
        covered = self.through * (1 - np.exp(-left))
        self.total = self.through * np.exp(-left)
        guesses = near_color / near if near else 0, all_color / left if left else 0
        self.color = self.color + covered * (share * guesses[0] + (1 - share) * guesses[1])
        if left:
            first = weighted / near if near else 0
            self.T[tail] = covered * (share * first + (1 - share) * a / left) / alpha[tail]
