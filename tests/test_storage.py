"""Numbers as render targets of 16 bits hold them, against NumPy's half floats and exact words."""

from fractions import Fraction

import numpy as np
import pytest
from readings import c, glsl

WORDS = ["unorm16_word", "unorm16_value", "unorm8_byte", "unorm8_value"]
LARGEST = {"unorm16_value": 65535, "unorm8_value": 255}
ROUNDINGS = ["rounded_to_half", "rounded_to_single"]
SIZES = [np.float32, np.float64]
in_both_sizes = pytest.mark.parametrize("dtype", SIZES, ids=["float32", "float64"])


def numbers(dtype) -> np.ndarray:
    """Every half float, middles of neighbours, what lies just beside, and extremes."""
    halves = np.arange(0x7C00, dtype=np.uint16).view(np.float16).astype(np.float64)
    middles = (halves[:-1] + halves[1:]) / 2
    x = np.concatenate([halves, middles, [65519.99, 65520, 1e6, 1e30]]).astype(dtype)
    x = np.concatenate([x, np.nextafter(x, dtype(0)), np.nextafter(x, dtype(np.inf))])
    return np.concatenate([x, -x, np.array([np.inf, -np.inf, np.nan], dtype)])


@in_both_sizes
def test_half_floats_are_those_of_ieee(dtype):
    x = numbers(dtype)
    with np.errstate(over="ignore"):
        expected = x.astype(np.float16).astype(dtype)
    np.testing.assert_array_equal(c.elementary("rounded_to_half", x), expected)


@in_both_sizes
def test_floats_are_those_of_ieee(dtype):
    rng = np.random.default_rng(2)
    sizes = 2.0 ** rng.uniform(-126, 127, 20_000)
    x = np.concatenate([sizes, np.spacing(sizes.astype("f4")) / 2 + sizes.astype("f4"), [0]])
    x = np.concatenate([x, -x]).astype(dtype)
    np.testing.assert_array_equal(c.elementary("rounded_to_single", x), x.astype("f4"))


@in_both_sizes
def test_words_round_half_up_and_stay_in_range(dtype):
    words = np.arange(65536)
    halfway = ((words[:-1] + 0.5) / 65535).astype(dtype)
    inside = np.concatenate([(words / 65535).astype(dtype), halfway, np.nextafter(halfway, 0)])
    # the product is not rounded first; for x of 64 bits it is too long for float64
    expected = [int(Fraction(float(x)) * 65535 + Fraction(1, 2)) for x in inside]
    np.testing.assert_array_equal(c.elementary("unorm16_word", inside), expected)
    outside = np.array([-1, -0.0, 1.5, np.inf, -np.inf, np.nan], dtype)
    np.testing.assert_array_equal(c.elementary("unorm16_word", outside), [0, 0, 65535, 65535, 0, 0])


@in_both_sizes
def test_bytes_round_half_up_and_come_back(dtype):
    bytes_ = np.arange(256).astype(dtype)
    values = c.elementary("unorm8_value", bytes_)
    halfway = ((bytes_[:-1] + dtype(0.5)) / dtype(255)).astype(dtype)
    inside = np.concatenate([values, halfway, np.nextafter(halfway, dtype(0))])
    expected = [int(Fraction(float(x)) * 255 + Fraction(1, 2)) for x in inside]
    np.testing.assert_array_equal(c.elementary("unorm8_byte", inside), expected)
    np.testing.assert_array_equal(c.elementary("unorm8_byte", values), bytes_)
    outside = np.array([-1, -0.0, 1.5, np.inf, -np.inf, np.nan], dtype)
    np.testing.assert_array_equal(c.elementary("unorm8_byte", outside), [0, 0, 255, 255, 0, 0])


@in_both_sizes
def test_words_come_back_as_themselves(dtype):
    words = np.arange(65536).astype(dtype)
    values = c.elementary("unorm16_value", words)
    assert values[0] == 0 and values[-1] == 1
    np.testing.assert_array_equal(c.elementary("unorm16_word", values), words)


@in_both_sizes
@pytest.mark.parametrize("function", [*ROUNDINGS, *WORDS])
def test_storage_is_the_same_bits_in_glsl(function, dtype):
    x = numbers(dtype)
    x = x[np.isfinite(x)]  # llvmpipe is free to drop the others
    if function == "rounded_to_single":
        x = x[(x == 0) | (np.abs(x) > 1e-37)]  # the others are 0 in one and not in the other
    elif function != "rounded_to_half":
        x = np.random.default_rng(1).random(20_000).astype(dtype) * (LARGEST.get(function, 1))
    np.testing.assert_array_equal(glsl.elementary(function, x), c.elementary(function, x))
