"""JAX's functions: they pass its own checks, and answer what moit answers."""

import doctest

import numpy as np
import pytest
import ragged_rays
from ragged_rays import NAMES, QUESTIONS, TECHNIQUES, numbers

import moit
from moit import gradients

jax = pytest.importorskip("jax", reason="JAX (moit[jax]) is not installed")
check_grads = pytest.importorskip("jax.test_util").check_grads
moit_jax = pytest.importorskip("moit.jax")

ENDS = np.array(ragged_rays.ENDS)


@pytest.fixture(autouse=True)
def doubles():
    """JAX has float64 in these tests."""
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


@pytest.mark.parametrize("technique", TECHNIQUES)
@pytest.mark.parametrize("question", QUESTIONS)
def test_check_grads_passes(question, technique):
    names, ask = QUESTIONS[question], getattr(moit_jax, question)

    def answer(*given):
        how = {"technique": technique, "offsets": ENDS, "depth_range": (1, 6)}
        return ask(**dict(zip(names, given, strict=True)), **how)

    given = [numbers()[name] for name in names]
    check_grads(answer, given, order=1, modes=["rev"])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_gradients_are_those_of_moit(dtype):
    given = numbers(dtype)
    del given["transmission"]

    @jax.jit
    def seen(given, ends):
        return moit_jax.composite(**given, offsets=ends, technique="power6", depth_range=(1, 6))

    f = moit.Fragments(ENDS, given["depth"], given["alpha"], given["color"], depth_range=(1, 6))
    expected, pullback = gradients.composite(f, "power6", background=given["background"][None])
    found, backward = jax.vjp(seen, given, ENDS)
    assert found.dtype == expected.dtype
    assert np.array_equal(found, expected[0])
    by = pullback(np.ones_like(expected))
    for name, one in backward(np.ones_like(found))[0].items():
        wanted = getattr(by, name)
        assert np.array_equal(one, wanted[0] if name == "background" else wanted), name


def test_layouts_of_rays_answer_alike():
    given = {name: one for name, one in numbers().items() if name in NAMES[:3]}
    counts = np.diff(ENDS)
    layouts = (
        {"offsets": ENDS},
        {"packed_info": np.stack([ENDS[:-1], counts], axis=1)},
        {"ray_indices": np.repeat(np.arange(3), counts), "n_rays": 3},
    )
    found = [moit_jax.composite(**given, technique="power4", **one) for one in layouts]
    assert all(np.array_equal(found[0], one) for one in found[1:])
    assert found[0].shape == (3, 4)


def test_answers_are_mapped_over_batches():
    given = numbers()
    depth = np.stack([given["depth"], given["depth"][::-1]])

    def seen(depth):
        how = {"technique": "power4", "offsets": ENDS, "depth_range": (1, 6)}
        return moit_jax.transmittance(depth, given["alpha"], **how)

    assert np.array_equal(jax.vmap(seen)(depth), np.stack([seen(one) for one in depth]))


def test_what_does_not_fit_is_refused():
    one = np.ones(2)
    with pytest.raises(TypeError, match="expected one of offsets, packed_info, ray_indices"):
        moit_jax.transmittance(one, one, technique="sorted")
    with pytest.raises(ValueError, match=r"offsets: expected \(P\+1,\)"):
        moit_jax.transmittance(one, one, technique="sorted", offsets=[[0, 2]])
    with pytest.raises(ValueError, match=r"alpha\[1\]: found 2.0; needed a number in \[0, 1\]"):
        moit_jax.transmittance(one, np.array([0.5, 2]), technique="sorted", offsets=[0, 2])
    with pytest.raises(TypeError, match="alpha: expected an array, got None"):
        moit_jax.transmittance(one, None, technique="sorted", offsets=[0, 2])
    with pytest.raises(ValueError, match="technique"):
        moit_jax.transmittance(one, one / 2, technique="no such", offsets=[0, 2])


def test_examples_run():
    found = doctest.testmod(moit_jax)
    assert found.attempted and not found.failed
