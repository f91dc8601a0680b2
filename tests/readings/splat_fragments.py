"""Depth, alpha and colour of splats' fragments from formulas, in complex numbers: a derivative is
what an imaginary step of 1e-100 leaves in the imaginary part, to the last digit of a double.

Nothing of it is moit's; what clamps looks at real parts, so of a limit the one side is taken.
"""

import numpy as np

from readings.splats import C1, HIGHER

STEP = 1e-100
ARRAYS = ("means", "scales", "rotations", "opacities", "sh")


def dot(a, b):
    return (a * b).sum(axis=-1)


def turned(q):
    """The columns of the matrix of a quaternion, of any length."""
    w, x, y, z = np.moveaxis(q / np.sqrt(dot(q, q))[..., None], -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def color(away, sh):
    x, y, z = np.moveaxis(away / np.sqrt(dot(away, away))[..., None], -1, 0)[..., None]
    value = 0.5 + 0.28209479177387814 * sh[:, 0]
    if sh.shape[1] > 1:
        value = value - C1 * y * sh[:, 1] + C1 * z * sh[:, 2] - C1 * x * sh[:, 3]
    for k in range(4, sh.shape[1]):
        norm, polynomial = HIGHER[k - 4]
        value = value + norm * polynomial(x, y, z) * sh[:, k]
    return np.where(value.real > 0, value, 0)


def on_the_screen(at, axes, size, scale, x, y):
    """Distance from the middle in deviations, squared, and depth, of the ellipses of "3dgs"; and
    what is left of opacity where what is added to them is to take as much off it."""
    z, q = at[:, 2], []
    for c, sign in ((0, 1), (1, -1)):
        slope, limit = at[:, c] / z, 1.3 / scale[c]
        held = np.where(np.abs(slope.real) > limit, np.copysign(limit, slope.real), slope)
        half = sign * scale[c] * size[c] / 2
        q.append((half / z)[:, None] * (axes[:, c] - held[:, None] * axes[:, 2]))
    a, b, c = dot(q[0], q[0]) + 0.3, dot(q[0], q[1]), dot(q[1], q[1]) + 0.3
    dx = x - ((scale[0] * at[:, 0] / z + 1) * size[0] - 1) / 2
    dy = y - ((1 - scale[1] * at[:, 1] / z) * size[1] - 1) / 2
    grown = a * c - b * b
    share = (dot(q[0], q[0]) * dot(q[1], q[1]) - b * b) / grown
    share = np.where(share.real > 0.000025, share, 0.000025) ** 0.5
    return (c * dx * dx - 2 * b * dx * dy + a * dy * dy) / grown, z, share


def along_the_ray(at, axes, size, scale, x, y):
    """The least distance along the ray, and where it is, of "exact"."""
    ray = [(2 * (x + 0.5) / size[0] - 1) / scale[0], (1 - 2 * (y + 0.5) / size[1]) / scale[1]]
    ray = np.stack([*ray, np.ones_like(x)], axis=1).astype(float)
    # in the sphere's space: coordinates along each axis, over its length
    length = (axes * axes).sum(axis=1)
    to, middle = np.einsum("nck,nc->nk", axes, ray), np.einsum("nck,nc->nk", axes, at)
    to, middle = to / length, middle / length
    depth = dot(to, middle) / dot(to, to)
    beside = middle - depth[:, None] * to
    return dot(beside, beside), depth, 1


def fragments(given, camera, size, convention, x, y, antialiased=False):
    """(depth, alpha, colour) where splats, one for each, are seen in pixels (x, y)."""
    means, scales, rotations, opacities, sh = given
    away = means - np.array(camera.eye)
    axes = camera.axes @ turned(rotations)
    if convention == "exact":
        least = 1e-4 * scales.max(axis=1, keepdims=True)
        scales = np.where(scales.real < least.real, least, scales)
    seen = along_the_ray if convention == "exact" else on_the_screen
    axes = axes * scales[:, None, :]
    square, depth, share = seen(away @ camera.axes.T, axes, size, camera.scale(size), x, y)
    alpha = opacities * (share if antialiased else 1) * np.exp(-0.5 * square)
    alpha = np.where(alpha.real >= 0.99, 0.99, alpha)
    return depth, alpha, color(away, sh)


def derivatives(splats, camera, size, x, y, which, seeds):
    """Of sum(seed * number) over fragments by each array of the splats: the derivative, and the
    sum of the sizes of what it adds up. which : (N,) the splat of each fragment."""
    given = [getattr(splats, name).astype(complex) for name in ARRAYS]
    found = []
    for i, array in enumerate(given):
        by, parts = np.zeros((2, *array.shape))
        for column in np.ndindex(array.shape[1:]):
            stepped = [one[which] for one in given]
            stepped[i][(slice(None), *column)] += 1j * STEP
            seen_by = (splats.convention, x, y, splats.antialiased)
            told = fragments(stepped, camera, size, *seen_by)
            each = 0.0
            for seed, numbers in zip(seeds, told, strict=True):
                slope = seed * numbers.imag / STEP
                each = each + (slope.sum(axis=1) if slope.ndim == 2 else slope)
            at = (slice(None), *column)
            by[at] = np.bincount(which, each, len(array))
            parts[at] = np.bincount(which, np.abs(each), len(array))
        found.append((by, parts))
    return found
