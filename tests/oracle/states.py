"""What techniques with a state read at each fragment, in mpmath, from their papers' formulas: for
differences, so nothing is rounded but by the digits that mpmath works with.

`seen(technique, depth, alpha, near, far)` gives the transmittance in front of each fragment and
what the ray lets through, `curve` the transmittance in front of other depths.
"""

import dataclasses
import functools
import math

import numpy as np
from mpmath import mp, mpf

from moit.catalog.network import network_of
from tests.oracle import power, trigonometric


def product(numbers):
    return mp.fprod(1 - a for a in numbers)


def warp_of(technique, depth, near, far):
    """From depth to what the technique works in."""
    if technique.range_per_pixel and technique.kind != "neural":  # which reads both
        near, far = min(depth), max(depth)
    near, far, low = mpf(near), mpf(far), technique.unit_range[0]

    def warped(one):
        one = min(max(one, near), far)
        if technique.depth_warp == "log":
            z = mp.log(one / near) / mp.log(far / near)
        elif technique.depth_warp == "linear":
            z = (one - near) / (far - near)
        else:
            return one
        return low + (1 - low) * z

    return warped


def absorbances(technique, alpha):
    if technique.kind == "moment-transparency":
        return [-mp.log1p(-mpf(technique.max_alpha) * one) for one in alpha]
    return [-mp.log1p(-min(one, mpf(technique.max_alpha))) for one in alpha]


def reader_of(technique, z, alpha, depth, near, far):
    if technique.kind != "neural-bounded" or not technique.range_per_pixel:
        return STATES[technique.kind](technique, z, alpha, depth)
    # of deviations a network knows in the image's range
    warped = warp_of(dataclasses.replace(technique, depth_range="image"), depth, near, far)
    unit = (warped(max(depth)) - warped(min(depth))) / 2
    return by_bounded(technique, z, alpha, depth, unit=unit)


@functools.cache
def seen(technique, depth, alpha, near, far):
    warped = warp_of(technique, depth, near, far)
    z = [warped(one) for one in depth]
    own = alpha if excludes_self(technique) else [mpf(0)] * len(alpha)
    read, total = reader_of(technique, z, alpha, depth, near, far)
    return [read(at, one) for at, one in zip(z, own, strict=True)], total


def curve(technique, depth, alpha, asked, near, far):
    warped = warp_of(technique, depth, near, far)
    read, _ = reader_of(technique, [warped(d) for d in depth], alpha, depth, near, far)
    return [read(warped(mpf(one)), mpf(0)) for one in asked]


def excludes_self(technique):
    return technique.kind in ("slices", "neural-bounded") or technique.excludes_self


def absorbance_of(technique, own):
    return absorbances(technique, [own])[0]


def power_moments(technique, z, a, count):
    b0 = mp.fsum(a)
    b = [mp.fsum(x * one**k for x, one in zip(a, z, strict=True)) / b0 for k in range(1, count + 1)]
    return power.biased(b, technique.bias_for(np.float64)), b0


def by_power(technique, z, alpha, depth):
    a = absorbances(technique, alpha)
    ray, b0 = power_moments(technique, z, a, technique.count)

    def read(at, own):
        own = absorbance_of(technique, own)
        return power.transmittance_but_self(ray, b0, at, own, technique.overestimation)

    return read, mp.exp(-b0)


def by_moment_transparency(technique, z, alpha, depth):
    """Sharpe 2018, and its supplement: the second pass is of what the first lets through."""
    a, beta = absorbances(technique, alpha), technique.overestimation
    first, b0 = power_moments(technique, z, a, 4)

    def once(at, own):
        return power.transmittance_but_self(first, b0, at, own, beta)

    if technique.passes == 1:
        return lambda at, own: once(at, absorbance_of(technique, own)), product(alpha)
    excluded = a if technique.excludes_self else [mpf(0)] * len(a)
    seen = [x * once(at, own) for x, at, own in zip(a, z, excluded, strict=True)]
    second, b0_seen = power_moments(technique, z, seen, 4)
    ratio = (1 - mp.exp(-b0)) / (1 - mp.exp(-b0_seen))

    def twice(at, own):
        own = absorbance_of(technique, own)
        own *= once(at, own if technique.excludes_self else mpf(0))
        T = power.transmittance_but_self(second, b0_seen, at, own, beta)
        return 1 - (1 - T) * ratio

    return twice, product(alpha)


def network_share(packed, x, layers=(8, 8, 1)):
    """As `Network.packed` has its layers, of numbers in mpmath."""
    at = 0
    for outputs in layers:
        rows = [packed[at + j * (len(x) + 1) :][: len(x) + 1] for j in range(outputs)]
        at += outputs * (len(x) + 1)
        y = [mp.fsum(w * one for w, one in zip(row, [*x, 1], strict=True)) for row in rows]
        x = [max(one, 0) for one in y] if outputs > 1 else y
    return 1 / (1 + mp.exp(-x[0]))


def weights_of(technique):
    return network_of(technique.network, technique.network_kind).packed()


def held(z, words):
    """An end of a pixel's extent: that far from z as rounding leaves it, wherever z moves."""
    known = float(z)
    half = float(np.float16(known))
    word = 2 * round((known + 1) / 2 * 65535) / 65535 - 1
    return z + (mpf(word if words else half) - mpf(known))


def by_neural(technique, z, alpha, depth, packed=None):
    """NMT; `z` may move by less than rounding its ends to 16 bits shows."""
    if packed is None:
        packed = [mpf(float(w)) for w in weights_of(technique)]
    a, words = absorbances(technique, alpha), technique.range_per_pixel
    near, far = held(min(z), words), held(max(z), words)
    b0, low = mp.fsum(a), mp.exp(-2 if words else near - far)

    def own(at):
        return max(-1, min(1, (2 * at - near - far) / (far - near))) if words else at

    places = [own(one) for one in z]
    sums = [mp.fsum(x * y**k for x, y in zip(a, places, strict=True)) for k in range(5)]
    end = 1 if words else far

    def read(at, _):
        if at < near - mpf(2) ** -11:
            return mpf(1)
        if at > far + mpf(2) ** -11:
            return mp.exp(-b0)
        share = (mp.exp(min(own(at) - end, 0)) - low) / (1 - low)
        x = [max(0, min(1, share)), len(z), *sums]
        return max(network_share(packed, x, (32, 16, 1)), mp.exp(-b0))

    return read, mp.exp(-b0)


def by_bounded(technique, z, alpha, depth, packed=None, unit=1):
    """Ours: between what moments prove a network decides."""
    if packed is None:
        packed = [mpf(float(w)) for w in weights_of(technique)]
    a, count = absorbances(technique, alpha), technique.moment_count
    ray, b0 = power_moments(technique, z, a, count)
    mean = ray.b[1]
    central = [
        mp.fsum(mp.binomial(k, j) * ray.b[j] * (-mean) ** (k - j) for j in range(k + 1))
        for k in range(7)
        if k <= count
    ]
    deviation = mp.sqrt(central[2])
    shape = [one / deviation**k for k, one in enumerate(central)]
    of_pixel = [mp.log(b0), mp.log(unit * deviation), shape[3], mp.log(shape[4])]
    if count > 4:
        of_pixel += [mp.sign(shape[5]) * mp.log(1 + abs(shape[5])), mp.log(shape[6])]

    def read(at, own):
        own = absorbance_of(technique, own)
        found = ray.at(at)
        others = max(b0 - own, 0)
        least = min(b0 * found.lower, others)
        most = min(b0 * found.lower + max(b0 * found.weight - own, 0), others)
        x = [least / b0, (most - least) / b0, own, (at - mean) / deviation, *of_pixel]
        return mp.exp(-(least + network_share(packed, x) * (most - least)))

    return read, mp.exp(-b0)


def by_circle(technique, z, alpha, depth):
    a, theta = absorbances(technique, alpha), mpf(technique.wrapping_zone)
    b0, beta = mp.fsum(a), mpf(technique.overestimation)
    keeps = 1 - mpf(technique.bias_for(np.float64))
    x = [trigonometric.point(one, theta) for one in z]
    b = [
        keeps * mp.fsum(w * p**k for w, p in zip(a, x, strict=True)) / b0
        for k in range(1, technique.count + 1)
    ]
    ray = trigonometric.Ray(b, theta)

    def read(at, own):
        own = absorbance_of(technique, own)
        found = ray.representation(at)
        x0 = found.points[0]
        pairs = list(zip(found.points, found.weights, strict=True))[1:]
        in_front = mp.fsum(w * trigonometric.share(p, x0, theta) for p, w in pairs)
        dimmed = b0 * in_front + beta * max(b0 * found.weights[0] - own, 0)
        return mp.exp(-min(max(dimmed, 0), b0 - own))

    return read, mp.exp(-b0)


def by_fourier(technique, z, alpha, depth):
    """Jansen and Bavoil 2010."""
    a = absorbances(technique, alpha)
    waves = range(1, (technique.coefficients - 1) // 2 + 1)
    total = mp.fsum(a)
    cosine = [
        2 * mp.fsum(x * mp.cospi(2 * k * d) for x, d in zip(a, z, strict=True)) for k in waves
    ]
    sine = [2 * mp.fsum(x * mp.sinpi(2 * k * d) for x, d in zip(a, z, strict=True)) for k in waves]

    def read(at, own):
        own = absorbance_of(technique, own)
        part = [1 / (2 * mp.pi * k) for k in waves]
        dimmed, shown = total * at, at
        for k, p, c, s in zip(waves, part, cosine, sine, strict=True):
            dimmed += p * (c * mp.sinpi(2 * k * at) + s * (1 - mp.cospi(2 * k * at)))
            shown += 2 * p * mp.sinpi(2 * k * at)
        return mp.exp(-min(max(dimmed - own * shown, 0), total - own))

    return read, mp.exp(-total)


def by_wavelets(technique, z, alpha, depth):
    """Means of the absorbance in front over cells, or where it is densities that are projected its
    values at their ends; between them straight lines."""
    a, cells = absorbances(technique, alpha), technique.coefficients
    density = technique.projected == "density"
    steps = cells if density else cells - 1
    total = mp.fsum(a)

    def behind(x, k):
        """How much of a surface at x counts at the end of cell k."""
        return mpf(int(x) <= k) if density else min(max(k + 1 - x, mpf(0)), mpf(1))

    places = [steps * one for one in z]
    ends = [mpf(0)]
    ends += [
        mp.fsum(s * behind(x, k) for s, x in zip(a, places, strict=True)) for k in range(cells)
    ]
    ends[-1] = total

    def read(at, own):
        own = absorbance_of(technique, own)
        x = steps * at
        cell = min(int(mp.floor(x)), cells - 1)
        inside = x - cell
        share = inside if density else inside * (1 - inside)
        dimmed = ends[cell] + (ends[cell + 1] - ends[cell]) * inside - own * share
        return mp.exp(-max(dimmed, 0))

    return read, mp.exp(-total)


def function_map(technique, z, alpha, depth):
    """Delalandre et al. 2011, the function's own projection: coefficients, and the total."""
    exact = [product(a for a, d in zip(alpha, depth, strict=True) if d < own) for own in depth]
    total = product(alpha)
    drops = [a * T for a, T in zip(alpha, exact, strict=True)]
    waves = range(1, technique.coefficients)
    c = [total + mp.fsum(w * d for w, d in zip(drops, z, strict=True))]
    c += [
        mp.sqrt(2)
        / (mp.pi * k)
        * mp.fsum(w * mp.sinpi(k * d) for w, d in zip(drops, z, strict=True))
        for k in waves
    ]
    return c, total


def read_function_map(technique, c, total):
    waves = range(1, technique.coefficients)

    def read(at, own):
        own = min(own, mpf(technique.max_alpha))
        T, shown = c[0], 1 - at
        for k in waves:
            T += c[k] * mp.sqrt(2) * mp.cospi(k * at)
            shown -= mp.sinpi(2 * k * at) / (mp.pi * k)
        T /= max(1 - own * shown, 1 - own)
        return min(max(T, min(total / (1 - own), 1)), 1)

    return read


def by_function_map(technique, z, alpha, depth):
    c, total = function_map(technique, z, alpha, depth)
    return read_function_map(technique, c, total), total


def by_slices(technique, z, alpha, depth):
    """Ours, of one pixel at the corner of the picture and with a slice at the border of each cell.
    What rounding the unchanged alpha and z adds to whole steps stays."""
    cells, most = technique.cells, 2**technique.bits - 1
    quantum = mp.log(most + (technique.bits == 16)) / most
    ends = [mpf(0)] * (cells + 2)
    own = {}
    marked = set()
    for at, a in zip(z, absorbances(technique, alpha), strict=True):
        cell = min(int(mp.floor(at * cells)), cells - 1)
        inside, steps = at * cells - cell, a / quantum
        threshold = mp.frac(mpf("0.0078125") + cell * mpf(159) / 256)
        code = steps + (mp.floor(mpf(float(steps)) + threshold) - mpf(float(steps)))
        near = code * (1 - inside)
        near += mp.nint(near) - mpf(float(near))
        ends[cell] += near
        ends[cell + 1] += code - near
        own[at] = near + inside * code
        marked.add(cell)

    def read(at, excluded):
        cell = min(int(mp.floor(at * cells)), cells - 1)
        before = mp.fsum(ends[:cell])
        if cell not in marked:
            return mp.exp(-quantum * (before + ends[cell]))
        inside = at * cells - cell
        twice = 2 * before + ends[cell] + inside * (ends[cell] + ends[cell + 1])
        if excluded:
            twice -= own[at]
        return mp.exp(-quantum * max(twice, 0) / 2)

    if technique.inside:
        read = within_moments(technique, z, alpha, read)
    return read, product(alpha)


def by_neural_slices(technique, z, alpha, depth, packed=None):
    """Ours, of one pixel at the corner of the picture, between whose slices a network decides. What
    rounding the unchanged alpha and z adds to whole steps and to the pixel's ends stays."""
    if packed is None:
        packed = [mpf(float(w)) for w in weights_of(technique)]
    last, most = technique.count - 1, 2**technique.bits - 1
    quantum = mp.log(most if technique.bits == 8 else most + 1) / most

    def end(at, rounded):
        word = rounded((float(at) + 1) / 2 * 65535)
        return at + (2 * mpf(word) / 65535 - 1 - mpf(float(at)))

    nearest, farthest = end(min(z), math.floor), end(max(z), math.ceil)

    def place(at):
        x = (at - nearest) / (farthest - nearest) * last
        cell = min(int(mp.floor(x)), last - 1)
        return cell, x - cell

    slices, own = [mpf(0)] * (last + 1), {}
    for at, a in zip(z, absorbances(technique, alpha), strict=True):
        (cell, inside), steps = place(at), a / quantum
        threshold = mp.frac(mpf("0.0078125") + mp.floor((at + 1) / 2 * 65535) * mpf(159) / 256)
        code = steps + (mp.floor(mpf(float(steps)) + threshold) - mpf(float(steps)))
        near = code * (1 - inside)
        near += mp.nint(near) - mpf(float(near))
        slices[cell] += near
        slices[cell + 1] += code - near
        own[at] = code, near
    total = mp.fsum(slices)

    def read(at, excluded):
        cell, inside = place(at)
        code, near = own[at] if excluded else (mpf(0), mpf(0))
        outer, front, middle, back, beyond = (
            mp.fsum(slices[: max(cell + k, 0)]) for k in range(-1, 4)
        )
        if not nearest <= at <= farthest:
            return mp.exp(-quantum * (front if at < nearest else back))
        both = back - front
        room = max(both - code, 0)
        twice = front + middle + inside * both - near - inside * code
        even = (max(twice, 0) / 2 - front) / max(room, 1)
        x = [front / max(total, 1), room / max(total, 1), absorbance_of(technique, excluded)]
        x += [inside, (middle - front) / max(both, 1)]
        x += [(front - outer) / max(total, 1), (beyond - back) / max(total, 1)]
        x += [min(max(mp.log(max(total * quantum, 1e-4)), -8), 8), min(max(even, 0), 1)]
        x += [min(max(mp.log(max(room * quantum, 1e-4)), -8), 3)]
        return mp.exp(-quantum * (front + network_share(packed, x) * room))

    return read, product(alpha)


def within_moments(technique, z, alpha, read):
    """Between what four power moments prove, of a bias as the core's bounds have."""
    a = absorbances(technique, alpha)
    places = [2 * one - 1 for one in z] if technique.depth_warp != "none" else z
    b0 = mp.fsum(a)
    powers = range(1, 5)
    b = [mp.fsum(x * one**k for x, one in zip(a, places, strict=True)) / b0 for k in powers]
    ray = power.biased(b, 1e-13)

    def bounded(at, own):
        found = ray.at(2 * at - 1 if technique.depth_warp != "none" else at)
        least, own = b0 * found.lower, absorbance_of(technique, own)
        most = min(b0 * (found.lower + found.weight), b0) - own
        return min(max(read(at, own), mp.exp(-most)), mp.exp(-least))

    return bounded


STATES = {
    "neural": by_neural,
    "neural-bounded": by_bounded,
    "slices": by_slices,
    "neural-slices": by_neural_slices,
    "power": by_power,
    "trig": by_circle,
    "moment-transparency": by_moment_transparency,
    "fourier": by_fourier,
    "wavelet": by_wavelets,
    "transmittance-function-map": by_function_map,
}
