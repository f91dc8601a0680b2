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


def splats():
    rng = np.random.default_rng(3)
    turns = rng.normal(size=(8, 4)) * 3
    scales, opacities = rng.uniform(0.2, 0.4, (8, 3)), rng.uniform(0.1, 0.6, 8)
    arrays = (rng.normal(size=(8, 3)) / 4, scales, turns, opacities)
    harmonics, behind = rng.uniform(-1, 1, (8, 1, 3)), (0.1, 0.2, 0.3)
    return [np.asarray(one, np.float32) for one in (*arrays, harmonics, behind)]


def seen_splats(means, scales, turns, opacities, sh, behind):
    how = {"camera": moit.Camera(eye=(0.5, 0.3, 2)), "size": (12, 8), "technique": "power4"}
    given = (means, scales, turns, opacities)
    return moit_jax.render(*given, sh=sh, background=behind, **how)


def test_pictures_of_splats_are_those_of_moit():
    *given, sh, behind = splats()
    plain = moit.Splats(*given, sh=sh)
    expected, pullback = gradients.render(
        plain, moit.Camera(eye=(0.5, 0.3, 2)), (12, 8), "power4", background=behind
    )
    found, backward = jax.vjp(jax.jit(seen_splats), *given, sh, behind)
    assert np.array_equal(found, expected)
    assert np.array_equal(found, seen_splats(*given, sh, behind))
    by, pulled = pullback(2 * expected), backward(2 * found)
    turned = by.rotations / np.linalg.norm(given[2], axis=1, keepdims=True)
    wanted = (by.means, by.scales, turned, by.opacities, by.sh, by.background)
    for one, other in zip(pulled, wanted, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-7)
        assert one.any()


def test_check_grads_passes_for_pictures():
    # differences of float32 have some two digits
    *arrays, behind = splats()
    check_grads(
        lambda *given: seen_splats(*given, behind), arrays, 1, ["rev"], atol=0.03, rtol=0.03
    )


def test_pictures_of_what_is_no_splats_are_refused():
    means, scales, turns, opacities, sh, _ = splats()
    colors = sh[:, 0] / 4 + 0.5
    how = {"camera": moit.Camera(), "size": (12, 8), "technique": "power4"}
    with pytest.raises(TypeError, match="colors, sh: expected one of the two"):
        moit_jax.render(means, scales, turns, opacities, **how)
    with pytest.raises(TypeError, match="means: expected float32, got float64"):
        moit_jax.render(means.astype(float), scales, turns, opacities, colors=colors, **how)
    with pytest.raises(TypeError, match="camera: expected a Camera, got str"):
        moit_jax.render(means, scales, turns, opacities, colors=colors, **how | {"camera": "here"})
    with pytest.raises(ValueError, match="opacities"):
        moit_jax.render(means, scales, turns, opacities + 1, colors=colors, **how)


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
