"""Numbers as colours and opacities."""

import re

import numpy as np
import pytest

import moit

BLUE_TO_RED = [(0, 0, 1), (1, 0, 0)]


def test_tables_are_linear_between_their_rows():
    values = np.linspace(-3, 5, 33)
    found = moit.map_scalars(values, BLUE_TO_RED, (0, 1, 0), color_space="linear")
    share = (values + 3) / 8
    np.testing.assert_allclose(found[:, 0], share, atol=1e-6)
    np.testing.assert_allclose(found[:, 2], 1 - share, atol=1e-6)
    np.testing.assert_allclose(found[:, 3], 1 - np.abs(2 * share - 1), atol=1e-6)
    assert found.dtype == np.float32


def test_maps_are_of_screens_and_limits_clip():
    found = moit.map_scalars([-9, 0.5, 9], [(0, 0, 0), (1, 1, 1)], limits=(0, 1))
    np.testing.assert_allclose(found[:, 0], [0, 0.21404, 1], atol=1e-4)
    np.testing.assert_array_equal(found[:, 3], 1)


def test_functions_and_names_are_maps():
    matplotlib = pytest.importorskip("matplotlib")
    values = np.arange(5)
    by_name = moit.map_scalars(values, "viridis", lambda share: share**2)
    by_map = moit.map_scalars(values, matplotlib.colormaps["viridis"], (values / 4) ** 2)
    np.testing.assert_allclose(by_name, by_map, atol=1e-6)
    with pytest.raises(ValueError, match="colors: matplotlib has no map 'viridian'"):
        moit.map_scalars(values, "viridian")


def test_one_value_or_none_is_fine():
    assert moit.map_scalars([3.0], BLUE_TO_RED).tolist() == [[0, 0, 1, 1]]
    assert moit.map_scalars([], (0.5, 0.5, 0.5)).shape == (0, 4)


def test_lines_take_them():
    line = moit.Lines(
        [[0, 0, 0], [1, 0, 0]], pixels=2, color=moit.map_scalars([0, 1], BLUE_TO_RED, (0.2, 0.6))
    )
    np.testing.assert_allclose(line.alpha, [0.2, 0.6])


BAD = [
    (([[1]], BLUE_TO_RED), {}, "values: expected shape (N,), got (1, 1)"),
    (([np.nan], BLUE_TO_RED), {}, "values[0]: found nan"),
    (([1], [(0, 0)]), {}, "colors: expected shape (3,) or (K, 3), got (1, 2)"),
    (([1], [(0, 0, 2), (0, 0, 2)]), {}, "colors[0, 2]: found 2.0; needed a number in [0, 1]"),
    (([1], BLUE_TO_RED, 1.5), {}, "opacity[0]: found 1.5; needed a number in [0, 1]"),
    (([1], BLUE_TO_RED), {"limits": (2, 1)}, "limits: expected (lower, upper)"),
    (([1], lambda share: share), {}, "colors: the function was given (1,) and gave (1,)"),
]


@pytest.mark.parametrize(("arguments", "options", "message"), BAD)
def test_bad_arguments_are_named(arguments, options, message):
    with pytest.raises(moit.PrimitiveError, match=re.escape(message)):
        moit.map_scalars(*arguments, **options)
