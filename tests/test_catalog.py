"""Techniques and their names: what str shows, technique reads back, and nothing else."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import moit
from moit import PowerMoments, WeightedBlended
from moit.catalog import WEIGHTS

shares = st.one_of(
    st.floats(0, 1),
    st.floats(0, 1, width=32).map(np.float32),
    st.floats(0, 1).map(np.float64),
    st.sampled_from([0, 1]),
    st.fractions(0, 1),
)
truths = st.sampled_from([True, False, np.True_, np.False_])


@st.composite
def power_moments(draw) -> PowerMoments:
    warp = draw(st.sampled_from(["log", "linear", "none"]))
    ranges = ["image"] if warp == "none" else ["image", "pixel"]
    bits, b0 = draw(st.sampled_from([(32, None), (16, None), (16, "half"), (16, "float32")]))
    return PowerMoments(
        draw(st.sampled_from([4, 6, 8])),
        bits,
        b0,
        overestimation=draw(shares),
        bias=draw(st.one_of(st.none(), st.just("published"), shares)),
        warp=warp,
        depth_range=draw(st.sampled_from(ranges)),
        normalize=draw(truths),
        exclude_self=draw(truths),
        max_alpha=draw(st.floats(0, 1, exclude_min=True, exclude_max=True)),
    )


weighted = st.builds(
    WeightedBlended,
    weight=st.sampled_from(WEIGHTS),
    depth_scale=st.floats(0, exclude_min=True, allow_infinity=False),
)


@given(st.one_of(power_moments(), weighted, st.sampled_from(moit.techniques())))
def test_a_name_reads_back_to_the_same_technique(technique):
    assert moit.technique(str(technique)) == technique
    assert str(moit.technique(str(technique))) == str(technique)


def test_numbers_of_any_type_are_floats():
    for half in (np.float32(0.5), np.float64(0.5), Fraction(1, 2)):
        assert str(PowerMoments(4, bias=half)) == "power4(bias=0.5)"
    assert str(PowerMoments(4, bias=0)) == "power4(bias=0.0)"


@pytest.mark.parametrize(
    "name, words",
    [
        ("power4(bias=0)(warp='linear')", "name=value"),
        ("power4(bias=0).x(warp='linear')", "name=value"),
        ("power4(0.5)", "name=value"),
        ("power4(**{'bias': 0})", "name=value"),
        ("power4(bias=0, bias=1)", "name=value"),
        ("power4(bias=print())", "name=value"),
        ("power4(bias=" + 3000 * "-" + "1)", "name=value"),
        ("power4(count=6)", "count"),
        ("wboit-eq7(weight='blog')", "weight"),
        ("power4(normalize=1)", "normalize: expected True or False"),
        ("power4(overestimation='x')", "overestimation: expected a number"),
        ("power4(overestimation=2)", "overestimation: expected a number from 0 to 1"),
        ("power4(bias=1e999)", "bias: expected a finite number"),
        ("power4(bias=1" + 400 * "0" + ")", "bias: expected a finite number"),
        ("power4(biass=0)", "did you mean 'bias'"),
        ("pover4", "did you mean 'power4'"),
        ("", "there is no ''"),
    ],
)
def test_a_bad_name_is_a_value_error_that_says_why(name, words):
    with pytest.raises(ValueError, match=words):
        moit.technique(name)


def test_the_weight_may_be_an_option_of_plain_wboit():
    assert str(moit.technique("wboit(weight='eq7')")) == "wboit-eq7"


def test_the_base_of_all_techniques_is_none():
    f = moit.scenes.load("panes", size=(2, 2))
    with pytest.raises(TypeError, match="technique: Technique"):
        moit.composite(f, moit.Technique())
