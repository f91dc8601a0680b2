"""Deep fragments in mpmath, for differences: csrc/kernels/deep_fragments.h says what is ours."""

import functools

import numpy as np
from mpmath import mp, mpf

import moit
from moit import _core
from moit.catalog.network import network_of
from moit.core.questions import CoreQuestion
from tests.oracle.states import absorbances, network_share, product, warp_of


class Sums:
    """What the network sees; `rounded` is how far half floats are from the sum that they hold."""

    def __init__(self, technique, depth, alpha, near, far, rounded=0):
        warped = warp_of(technique, depth, near, far)
        z, self.a = [warped(one) for one in depth], absorbances(technique, alpha)
        first, second, *self.others = sorted(range(len(z)), key=lambda i: depth[i])
        self.nearest = first, second
        farthest = float(z[self.others[-1]])
        last = z[self.others[-1]] + (mpf(float(np.float16(farthest))) - mpf(farthest))
        extent, b0 = last - z[second], mp.fsum(self.a)
        self.even = [mp.exp(-b0 * max(0, min(1, (one - z[second]) / extent))) for one in z]
        self.near = rounded + mp.fsum(self.a[i] * self.even[i] for i in self.others)
        self.tail = b0 - self.a[first] - self.a[second]
        passed = mp.exp(-self.tail)
        self.seen = [self.tail, self.near / self.tail, passed, z[second] - z[first], extent]


@functools.cache
def rounded_off(technique, depth, alpha, near, far):
    """Of a pixel of floats, from what the core's network sees."""
    f = moit.Fragments([0, len(depth)], depth, alpha, dtype="float64", depth_range=(near, far))
    given = CoreQuestion(f, technique, threads=1, cull_opaque=True).given
    tail, share = map(mpf, map(float, _core.network_features(*given)[0, :2]))
    exact = Sums(technique, list(map(mpf, depth)), list(map(mpf, alpha)), near, far)
    return share * tail - exact.near


@functools.cache
def seen(technique, depth, alpha, near, far):
    """Transmittance in front of each fragment, and what a pixel lets through, as numbers move by
    less than rounding to half floats shows: what these hold moves as what they round."""
    known = tuple(map(float, depth)), tuple(map(float, alpha))
    s = Sums(technique, depth, alpha, near, far, rounded_off(technique, *known, near, far))
    packed = [mpf(float(w)) for w in network_of(technique.network, "dfa").packed()]
    share = network_share(packed, s.seen, (32, 16, 1))
    first, second = s.nearest
    through = product([alpha[first], alpha[second]])
    covered = through * (1 - mp.exp(-s.tail))
    T = [mpf(1)] * len(depth)
    T[second] = 1 - alpha[first]
    for i in s.others:
        mixed = share * s.even[i] / s.near + (1 - share) / s.tail
        T[i] = covered * mixed * s.a[i] / alpha[i]
    return T, through * mp.exp(-s.tail)
