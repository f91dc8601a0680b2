"""Pixels are blended in groups of about equal counts: what each gets is what it gets alone."""

import numpy as np
import pytest

import moit

BACKGROUND = np.array([0.1, 0.2, 0.3])
NAMES = ("unsorted", "sorted", "wboit", "weighted-average", "power4")


@pytest.fixture(scope="module", params=["float32", "float64"])
def ragged(request) -> moit.Fragments:
    """Counts from 0 to beyond what is grouped, the last pixels of an array among the largest."""
    rng = np.random.default_rng(8)
    counts = np.concatenate(
        [rng.geometric(0.2, 700) - 1, rng.integers(0, 70, 90), [1, 0, 66, 3, 2]]
    )
    n = int(counts.sum())
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        rng.choice(np.linspace(1, 9, 60), n),
        rng.uniform(0, 0.9, n),
        rng.uniform(-1, 2, (n, 3)),
        depth_range=(1, 9),
        dtype=request.param,
    )


def one_by_one(f: moit.Fragments, in_front_first: bool) -> np.ndarray:
    """Over, a pixel at a time: T as the precision holds it, sums in double in order of arrival."""
    image = np.empty((len(f.offsets) - 1, 4))
    for p in range(len(image)):
        pixel = slice(f.offsets[p], f.offsets[p + 1])
        alpha = f.alpha[pixel].astype(float)
        first = np.argsort(f.depth[pixel], kind="stable")
        order = first if in_front_first else np.arange(len(alpha))[::-1]
        T, through = np.empty(len(alpha)), 1.0
        for i in order:
            T[i] = f.dtype.type(through)
            through *= 1.0 - alpha[i]
        total = np.zeros(3)
        for i in range(len(alpha)):
            total += alpha[i] * T[i] * f.color[pixel][i].astype(float)
        image[p, :3] = through * BACKGROUND + total
        image[p, 3] = 1.0 - through
    return image.astype(f.dtype)


@pytest.mark.parametrize(("name", "in_front_first"), [("unsorted", False), ("sorted", True)])
def test_over_is_what_a_loop_over_each_pixel_gives_to_the_bit(ragged, name, in_front_first):
    found = moit.composite(ragged, name, background=tuple(BACKGROUND))
    assert np.array_equal(found.reshape(-1, 4), one_by_one(ragged, in_front_first))


@pytest.mark.parametrize("name", NAMES)
def test_a_pixel_gets_the_same_bits_in_an_image_of_its_own(ragged, name):
    found = moit.composite(ragged, name, background=tuple(BACKGROUND)).reshape(-1, 4)
    for p in (*range(0, 780, 31), *range(780, len(found))):
        pixel = slice(ragged.offsets[p], ragged.offsets[p + 1])
        alone = moit.Fragments(
            [0, pixel.stop - pixel.start],
            ragged.depth[pixel],
            ragged.alpha[pixel],
            ragged.color[pixel],
            depth_range=(1, 9),
            dtype=ragged.dtype,
        )
        image = moit.composite(alone, name, background=tuple(BACKGROUND))
        assert np.array_equal(image.reshape(4), found[p]), p
