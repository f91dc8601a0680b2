"""What thick fragments are, by brute force: a ray in many short steps.

Slow and plain on purpose; it shares no formula with the core but the definition.
"""

import math

import numpy as np

STEPS = 40_000  # the error is of second order: some 1e-9


def normal(x):
    return np.array([0.5 * math.erfc(-v / math.sqrt(2)) for v in np.ravel(x)])


def share_before(depth, z, *, back=None, deviation=0.0, depth_range=(-math.inf, math.inf)):
    """What share of a fragment's absorbance lies nearer than each z."""
    z = np.asarray(z, float)
    if deviation > 0:
        near, far = depth_range
        ends = normal([(end - depth) / deviation for end in (near, far)])
        inside = normal((np.clip(z, near, far) - depth) / deviation)
        return (inside - ends[0]) / (ends[1] - ends[0])
    if back is not None and back > depth:
        return np.clip((z - depth) / (back - depth), 0, 1)
    return (z > depth).astype(float)


def ray(f):
    """(image, absorbance in front of each step's end, the ends) of a Fragments of one pixel."""
    near, far = f.depth_range
    places = [np.linspace(near, far, STEPS + 1)]
    for i, deviation in enumerate(f.deviation if f.deviation is not None else ()):
        if deviation > 0:
            places.append(np.linspace(-7, 7, STEPS // 4) * deviation + f.depth[i])
    if f.back is not None:
        places += [f.depth, f.back]
    surfaces = [i for i in range(len(f)) if is_surface(f, i)]
    places.append(np.nextafter(f.depth[surfaces], np.inf))  # a step that holds the surface alone
    places.append(f.depth[surfaces])
    z = np.unique(np.concatenate(places))
    z = z[(z >= near) & (z <= max(far, np.nextafter(far, np.inf)))]
    absorbed = np.zeros(len(z))
    emitted = np.zeros((len(z) - 1, 3))
    for i in range(len(f)):
        extent = {
            "back": None if f.back is None else f.back[i],
            "deviation": 0.0 if f.deviation is None else f.deviation[i],
        }
        whole = -math.log1p(-f.alpha[i])
        own = whole * share_before(f.depth[i], z, depth_range=(near, far), **extent)
        absorbed += own
        emitted += np.diff(own)[:, None] * f.color[i]
    step = np.diff(absorbed)
    seen = np.exp(-absorbed[:-1]) * -np.expm1(-step)
    color = np.divide(emitted, step[:, None], out=np.zeros_like(emitted), where=step[:, None] > 0)
    image = np.append(seen @ color, -np.expm1(-absorbed[-1]))
    return image, absorbed, z


def is_surface(f, i):
    box = f.back is not None and f.back[i] > f.depth[i]
    return not box and (f.deviation is None or f.deviation[i] == 0)
