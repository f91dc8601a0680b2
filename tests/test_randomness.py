"""`rng=` wherever something is random, as Scientific Python's SPEC 7 has it, beside `seed=`."""

import inspect

import numpy as np
import pytest
from small import some_fragments
from test_public import public

import moit
from moit.checks.randomness import seed_of


def drawn(**how):
    return moit.scenes.load("hair", (12, 9), **how)


def same(a, b):
    return a.depth.tobytes() == b.depth.tobytes()


def test_who_takes_a_seed_takes_an_rng():
    takers = {
        name: one
        for name, one in public().items()
        if inspect.isfunction(one) and "seed" in inspect.signature(one).parameters
    }
    assert {"frontier", "recommend", "scenes.load", "stability", "train"} <= set(takers)
    for name, one in takers.items():
        rng = inspect.signature(one).parameters.get("rng")
        assert rng is not None and rng.default is None, name
    assert set(CALLS) == set(takers)
    for call in CALLS.values():
        for wrong in (object(), "x"):
            with pytest.raises((TypeError, ValueError), match="rng: expected"):
                call(rng=wrong)
        with pytest.raises(TypeError, match="got both"):
            call(rng=1, seed=1)


CALLS = {
    "Fragments.shuffled": lambda **how: some_fragments().shuffled(**how),
    "check_technique": lambda **how: moit.check_technique("sorted", progress=False, **how),
    "frontier": lambda **how: moit.frontier("sorted", size="tiny", progress=False, **how),
    "recommend": lambda **how: moit.recommend("panes", max_error=1, progress=False, **how),
    "scenes.lines": lambda **how: moit.scenes.lines("convection-lines", 3, **how),
    "scenes.load": drawn,
    "scenes.meshes": lambda **how: moit.scenes.meshes("foliage", **how),
    "scenes.splats": lambda **how: moit.scenes.splats("hair-splats", 9, **how),
    "stability": lambda **how: moit.stability("sorted", rays=1, progress=False, **how),
    "train": lambda **how: moit.train("neural-bounded", "surfaces", progress=False, **how),
}


def test_an_integer_is_the_seed_of_old():
    assert same(drawn(rng=3), drawn(seed=3)) and same(drawn(rng=0), drawn())
    assert not same(drawn(rng=3), drawn(rng=4))
    f = some_fragments()
    assert same(f.shuffled(7), f.shuffled(seed=7)) and same(f.shuffled(7), f.shuffled(rng=7))


def test_a_generator_gives_another_seed_in_each_call():
    rng = np.random.default_rng(5)
    first, second = drawn(rng=rng), drawn(rng=rng)
    assert not same(first, second)
    again = np.random.default_rng(5)
    assert same(first, drawn(rng=again)) and same(second, drawn(rng=again))
    assert same(drawn(rng=np.random.SeedSequence(2)), drawn(rng=np.random.SeedSequence(2)))


def test_seeds_that_are_drawn_reach_both_ends():
    found = {seed_of(0, np.random.default_rng(k), 2) for k in range(40)}
    assert found == {0, 1, 2}
    with pytest.raises(ValueError, match="rng: expected an integer from 0 to 2, got 3"):
        seed_of(0, 3, 2)
    with pytest.raises(TypeError, match="rng: expected"):
        seed_of(0, True)


def test_what_is_asked_hangs_on_the_rng():
    cases = {seed: moit.scenes.meshes("foliage", rng=seed).meshes[-1].points for seed in (1, 2)}
    assert not np.array_equal(cases[1], cases[2])
    splats = [moit.scenes.splats("hair-splats", 9, rng=k).splats.means for k in (1, 1, 2)]
    assert np.array_equal(splats[0], splats[1]) and not np.array_equal(splats[0], splats[2])
    hard = {"families": "thin", "rays": 2, "precisions": "float64", "progress": False}
    asked = [{"rng": 3}, {"seed": 3}, {"rng": 4}]
    tables = [str(moit.stability("power4", **hard, **how).rows) for how in asked]
    assert tables[0] == tables[1] != tables[2]
