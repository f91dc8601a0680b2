"""What rays through deep samples are, in float64, as Kainz, Interpreting OpenEXR Deep Pixels, has
it: sample by sample and pair by pair, without a thought for speed. Light is colour times alpha.

A sample is (front, back, opacity (3,), light (3,)): of each channel its own opacity.
"""

import math

import numpy as np


def samples_of(f, pixel=0):
    """Those of one pixel of Fragments."""
    found = []
    for i in range(f.offsets[pixel], f.offsets[pixel + 1]):
        alpha, depth = float(f.alpha[i]), float(f.depth[i])
        passed = np.zeros(3) if f.transmission is None else f.transmission[i].astype(np.float64)
        light = alpha * f.color[i].astype(np.float64)
        if f.emission is not None:
            light = light + f.emission[i].astype(np.float64)
        back = depth if f.back is None else float(f.back[i])
        found.append((depth, back, alpha * (1 - passed), light))
    return found


def merged_pair(a1, c1, a2, c2):
    """(opacity, light) of two that coincide, in one channel: the document's mergeSamples."""
    if a1 == 1 and a2 == 1:
        return 1.0, (c1 + c2) / 2
    if a1 == 1:
        return 1.0, c1
    if a2 == 1:
        return 1.0, c2
    a = a1 + a2 - a1 * a2
    u1, u2 = -math.log1p(-a1), -math.log1p(-a2)
    v1 = u1 / a1 if a1 > 0 else 1.0
    v2 = u2 / a2 if a2 > 0 else 1.0
    w = a / (u1 + u2) if u1 + u2 > 0 else 1.0
    return a, (c1 * v1 + c2 * v2) * w


def merged(several):
    """(opacity (3,), light (3,)) of [(opacity, light), ...] that coincide. Opaque ones count alike,
    which pairs of pairs would not."""
    opacity, light = np.zeros(3), np.zeros(3)
    for c in range(3):
        opaque = [one[1][c] for one in several if one[0][c] == 1]
        if opaque:
            opacity[c], light[c] = 1.0, sum(opaque) / len(opaque)
            continue
        a, p = 0.0, 0.0
        for one in several:
            a, p = merged_pair(a, p, float(one[0][c]), float(one[1][c]))
        opacity[c], light[c] = a, p
    return opacity, light


def part(opacity, light, share):
    """(opacity, light) of a share of a volume: the document's splitVolumeSample."""
    parts = np.array([1.0 if a == 1 else -math.expm1(share * math.log1p(-a)) for a in opacity])
    seen = [p / a if a > 0 else share for p, a in zip(parts, opacity, strict=True)]
    return parts, light * seen


def tidy(samples):
    """[(front, back, opacity, light)] from front to back, none of which overlap."""
    depths = sorted({depth for one in samples for depth in one[:2]})
    found = []
    for k, near in enumerate(depths):
        here = [one[2:] for one in samples if one[0] == one[1] == near]
        if here:
            found.append((near, near, *merged(here)))
        if k + 1 == len(depths):
            break
        far = depths[k + 1]
        through = [
            part(a, p, (far - near) / (back - front))
            for front, back, a, p in samples
            if front <= near and far <= back
        ]
        if through:
            found.append((near, far, *merged(through)))
    return found


def flattened(samples):
    """(light (3,), opacity (3,)) of the whole ray."""
    light, through = np.zeros(3), np.ones(3)
    for _, _, a, p in tidy(samples):
        light, through = light + through * p, through * (1 - a)
    return light, 1 - through


def transmittance(samples, depth):
    """(3,) in front of a depth."""
    through = np.ones(3)
    for front, back, a, _ in samples:
        if front < depth:
            share = 1.0 if front == back else min(1.0, (depth - front) / (back - front))
            through = through * (1 - part(a, np.zeros(3), share)[0])
    return through
