"""`normalize` of techniques whose weights need not sum to what is covered."""

import gpu
import numpy as np
import pytest
from oracle import layers
from test_layers import CLOSE, assert_image, rays

import moit

precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])
EXACT_TOTALS = [
    "depth-peeling1(normalize=True)",
    "depth-peeling4(normalize=True)",
    "hybrid1(normalize=True)",
    "hybrid4(normalize=True)",
    "weighted-sum(normalize=True)",
    "adaptive4(normalize=True,quantized=False)",
]


def solid(dtype, **options):
    """Rays whose fragments all cover something, so that the foremost of them do."""
    return rays(dtype, alpha=(0.02, 0.7), **options)


@precisions
@pytest.mark.parametrize("name", EXACT_TOTALS)
def test_what_is_let_through_is_exact(name, dtype):
    for f in (rays(dtype), solid(dtype)):
        total = moit.total_transmittance(f, name, cull_opaque=False)
        exact = moit.total_transmittance(f, "sorted", cull_opaque=False)
        if name.startswith("depth-peeling"):  # where the foremost cover nothing, nothing is seen
            kept = moit.total_transmittance(f, name.partition("(")[0], cull_opaque=False)
            exact = np.where(kept == 1, 1, exact)
        assert np.abs(total - exact).max() <= CLOSE[dtype]


@pytest.mark.parametrize("device", ["cpu", "gpu"])
@precisions
@pytest.mark.parametrize("name", EXACT_TOTALS)
def test_hardly_visible_fragments_see_no_more_than_all(name, dtype, device):
    """What all of them cover is a difference from 1, with a rounding of its own."""
    rng = np.random.default_rng(5)
    depth, color = rng.uniform(1, 2, 240), rng.random((240, 3))
    alpha = 10.0 ** rng.uniform(-12, -5, 240)
    f = moit.Fragments(np.arange(0, 241, 6), *(x.astype(dtype) for x in (depth, alpha, color)))
    on = gpu.software_device() if device == "gpu" else device
    assert moit.transmittance(f, name, device=on).max() <= 1


@precisions
@pytest.mark.parametrize("count", [1, 3, 32])
def test_peeled_layers_stand_for_all_of_them(count, dtype):
    def expected(depth, alpha, color):
        T, _, drawn = layers.depth_peeling(count, depth, alpha)
        weight, total = alpha * T * drawn, np.prod(1 - alpha)
        return (weight @ color) * (1 - total) / max(weight.sum(), 1e-30), total

    technique = moit.DepthPeeling(count, normalize=True)
    f = solid(dtype)
    assert_image(f, technique, expected, dtype)
    # transmittance is that of the layers, as without
    np.testing.assert_array_equal(
        moit.transmittance(f, technique), moit.transmittance(f, moit.DepthPeeling(count))
    )


@precisions
@pytest.mark.parametrize("count", [1, 3, 32])
def test_the_tail_of_a_hybrid_covers_what_it_does(count, dtype):
    def expected(depth, alpha, color):
        T, core, drawn = layers.depth_peeling(count, depth, alpha)
        tail = np.where(drawn, 0, alpha)
        total = np.prod(1 - alpha)
        weight = np.where(drawn, alpha * T, tail * (core - total) / max(tail.sum(), 1e-30))
        return weight @ color, total

    assert_image(solid(dtype), moit.HybridTransparency(count, normalize=True), expected, dtype)


@precisions
def test_a_sum_with_exact_coverage_has_the_colours_of_the_average(dtype):
    f = solid(dtype, pixels=60)
    found, average, blended = (
        moit.composite(f, name, cull_opaque=False).astype(float)[0]
        for name in ("weighted-sum(normalize=True)", "weighted-average", "wboit")
    )
    seen = found[:, 3] > 0
    colours, mean = (image[seen, :3] / image[seen, 3:] for image in (found, average))
    np.testing.assert_allclose(colours, mean, rtol=20 * np.finfo(dtype).eps)
    np.testing.assert_array_equal(found[:, 3], blended[:, 3])
    assert np.abs(found[:, 3] - average[:, 3]).max() > 0.001


@precisions
def test_of_equal_opacities_it_is_the_average(dtype):
    f = rays(dtype, alpha=(0.3, 0.3))
    found, average = (
        moit.composite(f, name, background=(0.2, 0.4, 0.9))
        for name in ("weighted-sum(normalize=True)", "weighted-average")
    )
    assert np.abs(found - average).max() <= 2 * CLOSE[dtype]


@pytest.mark.parametrize("name", EXACT_TOTALS)
def test_with_transmission_channels_are_images_of_their_own(name):
    """Fragments that cover one channel only are seen in it as if the others were not there."""
    f = solid("float64", most=9)
    filters = np.ones((len(f.depth), 3))
    filters[:, 1] = 0
    one = moit.Fragments(
        f.offsets, f.depth, f.alpha, f.color * [0, 1, 0], transmission=filters,
        depth_range=f.depth_range,
    )  # fmt: skip
    found = moit.composite(one, name, background=(1, 1, 1), cull_opaque=False)
    assert np.isfinite(found).all()
    assert np.abs(found[..., 0] - 1).max() <= CLOSE["float64"]
    if name.startswith(("depth-peeling", "hybrid")):
        alone = moit.composite(f, name, background=(1, 1, 1), cull_opaque=False)
        assert np.abs(found - alone)[..., 1].max() <= CLOSE["float64"]


@precisions
@pytest.mark.parametrize("name", [*EXACT_TOTALS, "adaptive8(normalize=True)"])
def test_passes_on_a_gpu_have_the_same_bits(name, dtype):
    f = rays(dtype)
    for ask in (moit.composite, moit.transmittance, moit.total_transmittance):
        options = {"cull_opaque": False}
        ours = ask(f, name, device=gpu.device(), exact=True, **options)
        np.testing.assert_array_equal(ours, ask(f, name, **options))


def test_renormalised_pictures_are_closer():
    # Seen: rmse .063 to .037, .036 to .036, .31 to .065, .026 to .0092
    f = moit.scenes.load("grass-and-smoke", (96, 54))
    exact = moit.composite(f, "sorted").astype(float)

    def error(name):
        return np.sqrt(np.square(moit.composite(f, name) - exact).mean())

    for name, factor in (
        ("depth-peeling4", 0.9),
        ("hybrid4", 1.01),
        ("weighted-sum", 0.5),
        ("adaptive8", 0.7),
    ):
        assert error(f"{name}(normalize=True)") < factor * error(name)


def test_reports_say_what_is_not_renormalised_and_what_that_changes():
    f = moit.scenes.load("grass-and-smoke", (96, 54))
    names = ("adaptive8", "adaptive8(normalize=True)", "sorted", "hybrid4", "power4")
    report = moit.compare(f, names, metrics=["psnr", "flip"], repeat=1, progress=False)
    notes = {row.technique: row.note for row in report.rows}
    flip = {row.technique: row.flip for row in report.rows}
    words = "as published, not renormalised"
    assert notes["adaptive8"].startswith(words)
    *_, found = notes["adaptive8"].split()
    assert "with normalize=True flip" in notes["adaptive8"]
    assert float(found) == pytest.approx(flip["adaptive8(normalize=True)"], rel=0.01)
    # which changes little
    assert notes["hybrid4"] == words
    assert not any(notes[name] for name in ("adaptive8(normalize=True)", "sorted", "power4"))


def test_only_what_is_not_renormalised_has_another_form():
    other = {str(one): one.renormalised for one in moit.techniques()}
    named = [name for name, form in other.items() if form is not None]
    assert named == ["depth-peeling4", "weighted-sum", "adaptive4", "hybrid4"]
    for form in filter(None, other.values()):
        assert form.normalize and form.renormalised is None and not form.remark
