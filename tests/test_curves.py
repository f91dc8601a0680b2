"""Where the curve of a technique is exact, whatever the technique."""

import numpy as np
import pytest

import moit
from moit import PowerMoments

precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])


@precisions
@pytest.mark.parametrize("warp", ["log", "linear"])
@pytest.mark.parametrize("m", [4, 6, 8])
def test_a_range_per_pixel_makes_curves_exact_outside_each_pixels_own(m, warp, dtype):
    rng = np.random.default_rng(0)
    counts = np.array([0, 1, 2, 5, 30])
    offsets = np.append(0, np.cumsum(counts))
    depth = np.concatenate([rng.uniform(3 + p, 5 + p, n) for p, n in enumerate(counts)])
    f = moit.Fragments(offsets, depth, rng.uniform(0, 1, counts.sum()), dtype=dtype)
    technique = PowerMoments(m, warp=warp, depth_range="pixel")
    total = moit.total_transmittance(f, technique).ravel()
    for p in range(len(counts)):
        own = f.depth[offsets[p] : offsets[p + 1]]
        if not len(own):
            own = np.array([4.0])
        around = [np.nextafter(own.min(), 0), own.max(), np.nextafter(own.max(), 99)]
        curve = moit.transmittance(f, technique, around)[0, p]
        assert curve[0] == 1
        assert curve[2] == total[p] <= curve[1]
        lower, upper = moit.bounds(f, technique, around)
        assert lower[0, p, 0] == upper[0, p, 0] == 1
        assert upper[0, p, 2] - lower[0, p, 2] <= 8 * np.finfo(dtype).eps


@pytest.mark.parametrize("technique", ["sorted", "power4"])
def test_a_fragment_beyond_its_range_by_rounding_occludes_nothing_in_front_of_it(technique):
    depth = np.array([0.1], np.float32)  # rounded up
    f = moit.Fragments([0, 1], depth, np.array([0.5], np.float32), depth_range=(0.01, 0.1))
    between = (0.1 + float(depth[0])) / 2
    assert 0.1 < between < float(depth[0])
    assert moit.transmittance(f, technique, [between])[0, 0, 0] > 0.6  # 0.5 were all of it
    lower, upper = moit.bounds(f, technique, [between])
    assert lower[0, 0, 0] <= 1 == upper[0, 0, 0]
