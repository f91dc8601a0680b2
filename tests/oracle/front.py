"""Front layers over a tail in mpmath, for differences: csrc/core/techniques/front.c is ours."""

import dataclasses
import functools

import numpy as np
from mpmath import mp, mpf

from tests.oracle.states import STATES, absorbances, excludes_self, product, warp_of


class Biased:
    """A technique of moments with a bias that is no float."""

    def __init__(self, technique, bias):
        self.technique, self.bias = technique, bias

    def __getattr__(self, name):
        return getattr(self.technique, name)

    def bias_for(self, dtype):
        return self.bias


def nearest(technique, depth):
    order = sorted(range(len(depth)), key=lambda i: depth[i])
    return order[: technique.layers], order[technique.layers :]


def bias_of(technique, a, others, dtype):
    """Of the tail: it grows as what is left of rounding is more of it."""
    tail = technique.behind
    published = dataclasses.replace(tail, bias="published").bias_for(np.float32)
    covering = mpf(published) * (mpf("2e-8") if dtype == "float64" else 1)
    own = covering * mp.fsum(a) / mp.fsum(a[i] for i in others)
    return min(max(own, mpf(tail.bias_for(dtype))), mpf("0.2"))


def reader(technique, depth, alpha, near, far, dtype="float64"):
    """What reads the tail at a z, less an alpha; the warp; and what reaches the background."""
    tail, (front, others) = technique.behind, nearest(technique, depth)
    warped, a = warp_of(tail, depth, near, far), absorbances(tail, alpha)
    known = Biased(tail, bias_of(technique, a, others, dtype))
    own = ([one[i] for i in others] for one in ([warped(d) for d in depth], alpha, depth))
    read, passed = STATES[tail.kind](known, *own)
    return read, warped, product(alpha[i] for i in front) * passed


@functools.cache
def seen(technique, depth, alpha, near, far, dtype="float64"):
    """Transmittance in front of each fragment, and what a pixel lets through."""
    front, others = nearest(technique, depth)
    read, warped, total = reader(technique, depth, alpha, near, far, dtype)
    T, through = [mpf(1)] * len(depth), mpf(1)
    for i in front:
        T[i] = through
        through *= 1 - alpha[i]
    for i in others:
        own = alpha[i] if excludes_self(technique.behind) else mpf(0)
        T[i] = through * read(warped(depth[i]), own)
    return T, total


def scale(technique, depth, alpha, T, total):
    """Of each fragment in the picture: the tail covers what it does."""
    front, others = nearest(technique, depth)
    covers = mp.fsum(alpha[i] * T[i] for i in others)
    due = product(alpha[i] for i in front) - total
    factor = due / covers if technique.normalize else mpf(1)
    return [mpf(1) if i in front else factor for i in range(len(depth))]


def curve(technique, depth, alpha, asked, near, far):
    front, _ = nearest(technique, depth)
    read, warped, _ = reader(technique, depth, alpha, near, far)
    found = []
    for one in asked:
        nearer = [i for i in front if depth[i] < one]
        T = product(alpha[i] for i in nearer)
        found.append(T * read(warped(mpf(one)), mpf(0)) if len(nearer) == len(front) else T)
    return found
