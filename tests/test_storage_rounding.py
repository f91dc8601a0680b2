"""moit.storage rounds as targets do."""

import numpy as np
import pytest
from own_techniques import PICTURES, PythonTechnique, halves
from small import some_fragments

import moit


def test_halves_are_rounded_to_the_nearest_and_stay_finite():
    words = np.arange(65536, dtype=np.uint16).view(np.float16)
    words = words[np.isfinite(words)].astype(np.float64)
    np.testing.assert_array_equal(moit.storage.half(words), words)
    assert moit.storage.half([1e6, -1e6, np.inf]).tolist() == [65504.0, -65504.0, 65504.0]
    even = 1 + np.arange(4) * 2.0**-11  # every other lies in the middle
    assert moit.storage.half(even).tolist() == [1, 1, 1 + 2.0**-10, 1 + 2.0**-9]


@pytest.mark.parametrize(("name", "steps"), [("unorm16", 65535), ("unorm8", 255)])
def test_unorm_is_rounded_to_the_nearest_and_clamped(name, steps):
    way = getattr(moit.storage, name)
    words = np.arange(steps + 1)
    for dtype in (np.float32, np.float64):
        held = (words / steps).astype(dtype)
        np.testing.assert_array_equal(way(held), held)
        np.testing.assert_array_equal(way((words[:-1] + 0.51) / steps), words[1:] / steps)
        np.testing.assert_array_equal(way((words[:-1] + 0.49) / steps), words[:-1] / steps)
        assert way(held).dtype == dtype
    assert way([-1, 2, np.nan, np.inf]).tolist() == [0, 1, 0, 1]


def test_storage_takes_names_and_knows_bits():
    assert moit.storage.BITS == {"unorm8": 8, "unorm16": 16, "half": 16, "float32": 32}
    for name in moit.storage.BITS:
        np.testing.assert_array_equal(
            moit.storage.rounded([0.3], name), getattr(moit.storage, name)([0.3])
        )
    with pytest.raises(ValueError, match="storage"):
        moit.storage.rounded([0.3], "quarter")
    with pytest.raises(TypeError, match="values"):
        moit.storage.half(["a"])


@pytest.mark.parametrize("storage", [None, *moit.storage.BITS])
def test_sums_are_rounded_after_every_fragment_in_the_order_of_arrival(storage):
    f = some_fragments(most=9)
    values = np.random.default_rng(0).random((len(f), 3))
    expected = np.zeros((len(f.counts), 3))
    for p in range(len(f.counts)):
        for i in range(f.offsets[p], f.offsets[p + 1]):
            expected[p] = expected[p] + values[i]
            if storage:
                expected[p] = moit.storage.rounded(expected[p], storage)
    np.testing.assert_array_equal(moit.storage.added(f, values, storage), expected)
    np.testing.assert_array_equal(moit.storage.added(f, values[:, 0], storage), expected[:, 0])
    with pytest.raises(ValueError, match="values"):
        moit.storage.added(f, values[:-1])


def test_half_floats_of_wboit_are_rounded_as_targets_do():
    """The technique's own sums, of its weights, with 16 bits, but for the total in a byte."""
    f = PICTURES["surfaces"]
    one = moit.WeightedBlended("eq7", bits=16)

    def weights(f):
        own = moit.WeightedBlended("eq7")
        alone = moit.Fragments(
            np.arange(len(f) + 1), f.depth, f.alpha, f.color, depth_range=f.depth_range
        )
        fields = own.fields_for(alone)
        return moit._core.target_sums(alone, fields, 1)[..., 3].ravel()

    def composite(f, background):
        light = np.concatenate([f.color, np.ones((len(f), 1))], axis=1)
        sums = moit.storage.added(f, light * weights(f)[:, None], "half")
        through = np.ones(len(f.counts))
        for layer in range(f.counts.max()):
            here = np.flatnonzero(f.counts > layer)
            held = through[here] * (1 - f.alpha[f.offsets[here] + layer])
            through[here] = moit.storage.unorm8(held)
        color = np.divide(sums[:, :3], sums[:, 3:], where=sums[:, 3:] > 0, out=0 * sums[:, :3])
        image = (1 - through)[:, None] * color + through[:, None] * background
        return np.concatenate([image, 1 - through[:, None]], axis=1)

    mine = PythonTechnique("mine", halves, composite=composite)
    off = np.abs(moit.composite(f, mine) - moit.composite(f, one))
    assert off.max() < 2e-3
