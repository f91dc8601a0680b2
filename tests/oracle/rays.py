"""What a list of fragments does without any approximation: transmittance, moments, warped depth.

Inputs are the numbers as stored (float32 or float64 are exact in mpmath); nothing is rounded
before the last step.
"""

from collections.abc import Sequence

from mpmath import mp, mpf

DIGITS = 80


def transmittance(depth: Sequence, alpha: Sequence, at: Sequence) -> list[mpf]:
    """Product of 1 - alpha over the fragments strictly nearer than each of `at` (eq. 1)."""
    with mp.workdps(DIGITS):
        order = sorted(range(len(depth)), key=lambda i: depth[i])
        left = mpf(1)
        found: dict[float, mpf] = {}
        asked = sorted(set(map(float, at)))
        following = 0
        for z in asked:
            while following < len(order) and float(depth[order[following]]) < z:
                left *= 1 - mpf(float(alpha[order[following]]))
                following += 1
            found[z] = left
        return [found[float(z)] for z in at]


def moments(depth: Sequence, alpha: Sequence, count: int) -> tuple[mpf, list[mpf]]:
    """b0 and b1..bm divided by b0, for depths already in [-1, 1]; (0, zeros) for clear rays."""
    with mp.workdps(DIGITS):
        absorbance = [-mp.log1p(-mpf(float(a))) for a in alpha]
        b0 = mp.fsum(absorbance)
        if b0 == 0:
            return mpf(0), [mpf(0)] * count
        z = [mpf(float(one)) for one in depth]
        return b0, [
            mp.fsum(a * x**k for a, x in zip(absorbance, z, strict=True)) / b0
            for k in range(1, count + 1)
        ]


def warped(depth, near, far, warp: str = "log") -> mpf:
    """Depth in [-1, 1] as section 3.3 maps it; the middle where the range is empty."""
    with mp.workdps(DIGITS):
        depth, near, far = mpf(float(depth)), mpf(float(near)), mpf(float(far))
        if warp == "none":
            return depth
        if near == far:
            return mpf(0)
        if warp == "log":
            depth, near, far = mp.log(depth), mp.log(near), mp.log(far)
        return 2 * (depth - near) / (far - near) - 1
