"""Scenes of streamlines, and of two lines that are seen through one another which is in front."""

import numpy as np
import pytest

import moit
from moit.experiments.line_sets import most_seen, order_kept

NAMES = ("turbulence-lines", "convection-lines")


@pytest.mark.parametrize("name", NAMES)
def test_opacity_tells_the_attribute(name):
    scene = moit.scenes.lines(name, 50)
    assert len(scene.lines) == 50
    order = np.argsort(scene.attribute)
    assert (np.diff(scene.lines.alpha[order]) >= -1e-6).all()
    assert scene.lines.alpha.min() < 0.05
    assert scene.lines.alpha.max() > 0.9
    assert np.abs(scene.lines.positions).max() < 1.6
    same, other = (moit.scenes.lines(name, 50, seed).lines.positions for seed in (0, 1))
    np.testing.assert_array_equal(scene.lines.positions, same)
    assert same.shape != other.shape or np.abs(same - other).max() > 0.1


def test_lines_follow_a_flow_without_sources():
    # what such a flow carries keeps its volume: seeds spread evenly stay so within a roll's walls
    lines = moit.scenes.lines("convection-lines", 2000).lines
    at = lines.first[:-1] + 15
    whole = (at < lines.first[1:]) & (np.abs(lines.positions[lines.first[:-1], 0]) < 1)
    height = lines.positions[at[whole], 2]
    counts = np.histogram(height, bins=4, range=(-0.95, 0.95))[0]
    assert counts.sum() > 1000
    assert counts.min() > 0.75 * counts.max()


def test_names_and_counts_are_checked():
    with pytest.raises(ValueError, match="no scene of lines 'turbulence'"):
        moit.scenes.lines("turbulence")
    with pytest.raises(ValueError, match="count: expected at least 1, got 0"):
        moit.scenes.lines(NAMES[0], 0)
    with pytest.raises(TypeError, match="name: expected the name of a scene"):
        moit.scenes.lines(3)


def pixels():
    """Four pixels: far before near, near before far, a faint one, one at a depth."""
    return moit.Fragments(
        [0, 3, 5, 7, 9],
        [4, 2, 3, 1, 2, 1, 2, 1, 1],
        [0.5, 0.4, 0.02, 0.5, 0.8, 0.5, 0.01, 0.5, 0.6],
        np.full((9, 3), 0.5),
        depth_range=(0.5, 5),
    )


def test_two_fragments_that_are_seen_are_found():
    seen = most_seen(pixels())
    np.testing.assert_array_equal(seen.pixels, [0, 1])
    np.testing.assert_array_equal(seen.near, [1, 3])
    np.testing.assert_array_equal(seen.far, [0, 4])
    np.testing.assert_allclose(seen.order, [1 - 0.6 * 0.98, 0.5], rtol=1e-6)


def test_what_is_in_front_is_kept_lost_or_reversed():
    f = pixels()
    seen = most_seen(f)
    np.testing.assert_allclose(order_kept(f, seen, "sorted"), 1, rtol=1e-5)
    np.testing.assert_allclose(order_kept(f, seen, "weighted-average"), 0, atol=1e-5)
    blended = order_kept(f, seen, "unsorted")  # the last is in front
    assert blended[0] > 0
    assert blended[1] < 0
