"""What device="gpu" computes unless exact=True is asked for: by texts for engines, in floats."""

import numpy as np
import pytest
from gpu import software_device

import moit
from moit.gpu.bindings import FACTOR
from moit.gpu.passes import Constants, passes_of

MOMENTS = ("power4", "power6", "power8", "trig2", "trig3", "trig4")
OPTIONS = (
    "power4(bias='published',overestimation=0.0)",
    "power6(exclude_self=True)",
    "power8(overestimation=1.0)",
    "trig3(exclude_self=True,overestimation=0.75)",
    "power4(max_alpha=0.75)",
    "power6(normalize=False)",
)
# Without a text for engines, or of fragments that it does not know.
OTHERS = ("power4-16", "trig3(wrapping_zone=0.5)", "wavelet", "wboit", "sorted")


@pytest.fixture(scope="module")
def f():
    return moit.scenes.load("hair", (48, 36))


def far_off(found, truth):
    """Errors of transmittance that 1 % and 0.1 % of the fragments exceed."""
    return np.quantile(np.abs(found - truth), [0.99, 0.999])


@pytest.mark.parametrize("name", MOMENTS + OPTIONS)
def test_engines_texts_are_as_near_to_double_as_exact_passes_in_float(f, name):
    truth = moit.transmittance(f, name, dtype="float64")
    exact = moit.transmittance(f, name, device=software_device(), exact=True)
    found = moit.transmittance(f, name, device=software_device())
    assert found.dtype == np.float32
    assert not np.array_equal(found, exact)  # another text
    # What float32 keeps of moments moves both by far more than they are apart.
    assert (far_off(found, truth) <= 1.5 * far_off(exact, truth) + 2e-4).all()
    assert (far_off(found, exact) <= 1.5 * far_off(exact, truth) + 2e-4).all()


@pytest.mark.parametrize("name", MOMENTS + OPTIONS)
def test_pictures_and_curves_are_theirs_too(f, name):
    device = software_device()
    ask = {"background": (0.25, 0.5, 1.0)}
    exact = moit.composite(f, name, device=device, exact=True, **ask)
    np.testing.assert_allclose(moit.composite(f, name, device=device, **ask), exact, atol=3e-3)
    depths = np.linspace(*f.depth_range, 9)
    exact = moit.transmittance(f, name, depths, device=device, exact=True)
    found = moit.transmittance(f, name, depths, device=device)
    assert np.quantile(np.abs(found - exact), 0.99) < 2e-4
    total = moit.total_transmittance(f, name, device=device)
    np.testing.assert_allclose(total, moit.total_transmittance(f, name), atol=1e-6)


@pytest.mark.parametrize("name", MOMENTS)
def test_triangles_are_drawn_by_them(name):
    options = {"device": software_device(), "target": "rgba32f", "report": True}
    exact = moit.render("teapots", name, (64, 36), exact=True, **options)
    found = moit.render("teapots", name, (64, 36), **options)
    assert found.way == exact.way == "add"
    assert not np.array_equal(found.image, exact.image)
    atol = 3e-3 if name.startswith("trig") else 5e-4  # as rounding of their sums moves them
    np.testing.assert_allclose(found.image, exact.image, atol=atol)
    assert found.memory["factors"] < exact.memory["factors"] or name == "power4"


@pytest.mark.parametrize("name", MOMENTS)
def test_their_factors_are_computed_in_floats(f, name):
    technique = moit.technique(name)
    fields = technique.fields_for(f)
    for exact in (True, False):
        passes = passes_of(technique, Constants.of(fields, False, f.depth_range, exact))
        doubles = {stage.number: stage.double for stage in passes.stages}
        assert doubles[FACTOR] is exact
    # fragments in double are answered in double
    passes = passes_of(technique, Constants.of(fields, True, f.depth_range, False))
    assert not passes.engine


@pytest.mark.parametrize("name", OTHERS)
def test_what_has_no_such_text_is_exact(f, name):
    found = moit.transmittance(f, name, device=software_device())
    np.testing.assert_array_equal(found, moit.transmittance(f, name))


def test_fragments_in_double_are_exact(f):
    found = moit.transmittance(f, "power6", device=software_device(), dtype="float64")
    np.testing.assert_array_equal(found, moit.transmittance(f, "power6", dtype="float64"))


@pytest.mark.parametrize("name", ("power4", "power8", "trig3"))
def test_empty_pixels_and_thick_fog_are_there(name):
    depth = np.concatenate([np.linspace(1, 2, 4000), [1.5]])
    fog = moit.Fragments(
        [0, 4000, 4000, 4001],
        depth,
        np.full(4001, 0.9),
        np.full((4001, 3), (0.25, 0.5, 1.0)),
        shape=(1, 3),
        dtype="float32",
    )
    found = moit.composite(fog, name, device=software_device(), background=(1, 0, 0))
    expected = moit.composite(fog, name, background=(1, 0, 0))
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_products_are_split_where_fma_rounds_twice(monkeypatch):
    device = software_device()
    if device.fuses:
        pytest.skip("this device's fma rounds once")
    # nearly one surface: what is left of moments is what products lose
    rng = np.random.default_rng(5)
    depth = (rng.uniform(1, 9, (200, 1)) * (1 + 1e-4 * rng.normal(size=(200, 3)))).ravel()
    f = moit.Fragments(
        np.arange(201) * 3,
        depth,
        rng.uniform(0.1, 0.9, 600),
        shape=(1, 200),
        depth_range=(1, 10),
        dtype="float32",
    )
    truth = moit.transmittance(f, "power4", device=device, exact=True)
    split = np.abs(moit.transmittance(f, "power4", device=device) - truth).max()
    with monkeypatch.context() as patch:
        patch.setitem(device.__dict__, "fuses", True)
        whole = np.abs(moit.transmittance(f, "power4", device=device) - truth).max()
    assert split < 1e-4 < whole


def test_exact_is_a_truth_value(f):
    with pytest.raises(TypeError, match="exact"):
        moit.composite(f, "power4", exact="yes")
    with pytest.raises(TypeError, match="exact"):
        moit.render("teapots", "power4", (8, 6), exact=1)
