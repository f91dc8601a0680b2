"""AVBOIT as published: its light behind slices, and its known troubles."""

import numpy as np
import pytest

import moit
from moit import AdaptiveVoxels, Slices
from moit.numerics.hard_cases import FAMILIES


def one_ray(depth, alpha):
    return moit.Fragments(
        [0, len(depth)], np.array(depth, float), np.array(alpha, float), depth_range=(0, 1)
    )


def voxels(**options):
    return AdaptiveVoxels(**{"resolution": 1, "warp": "none", **options})


def spline(x):
    """The cubic B-spline at distances from its middle."""
    x = np.abs(x)
    near = 2 / 3 - x**2 + x**3 / 2
    return np.where(x < 1, near, np.where(x < 2, (2 - x) ** 3 / 6, 0))


@pytest.mark.parametrize("kind, bias", [("linear", 2), ("cubic", 2.5)])
def test_slices_have_the_light_behind_them(kind, bias):
    """By the definition: shares of the two slices, rounded; sums; bytes; read slices nearer."""
    cells = 64
    rng = np.random.default_rng(0)
    depth = np.append(rng.random(30), (np.arange(cells) + 0.5) / cells)
    alpha = np.append(rng.uniform(0.05, 0.4, 30), np.full(cells, 0.1))
    f = one_ray(depth, alpha)
    T = moit.transmittance(f, voxels(cells=cells, count=128, filter=kind))
    x, tau = depth * cells, -np.log1p(-alpha)
    first, inside = np.floor(x).astype(int), x - np.floor(x)
    most = np.log(255)
    codes = np.zeros(cells + 1)
    for at, share in ((first, 1 - inside), (first + 1, inside)):
        np.add.at(codes, at, np.rint(np.minimum(tau * share / most, 1) * 255))
    light = np.rint(255 * np.exp(-np.cumsum(codes) * most / 255)) / 255
    read = x - bias
    weigh = spline if kind == "cubic" else lambda x: np.maximum(1 - np.abs(x), 0)
    at = np.arange(-2, cells + 3)
    weights = weigh(np.maximum(read, 0)[:, None] - at)
    expected = np.where(read < 0, 1, weights @ light[np.clip(at, 0, cells)])
    np.testing.assert_allclose(T, expected, atol=1e-6)


def test_blocks_are_blended_by_a_cubic_spline():
    """One block of all has a surface in front of what the others have, too."""
    side, width = 4, 24
    pixel = np.arange(width * width)
    x, y = pixel % width, pixel // width
    covered = (x // side == 3) & (y // side == 2)
    counts = 1 + covered
    f = moit.Fragments(
        np.append(0, np.cumsum(counts)),
        np.concatenate([[0.9, 0.3][:n] for n in counts]),
        np.full(counts.sum(), 0.75),
        shape=(width, width),
        depth_range=(0, 1),
    )
    T = moit.transmittance(f, voxels(resolution=side, filter="cubic"))[f.offsets[:-1]]
    share = spline((x + 0.5) / side - 3.5) * spline((y + 0.5) / side - 2.5)
    np.testing.assert_allclose(T, 1 - 0.75 * share, atol=2 / 255)
    line = moit.transmittance(f, voxels(resolution=side))[f.offsets[:-1]]
    assert np.abs(T - line).max() > 0.2  # which reaches no further than the next block


def test_thin_layers_are_lost():
    """Less than half a step in each slice is rounded away: a thousand dim nothing."""
    n = 1000
    f = one_ray((np.arange(n) + 0.5) / n, np.full(n, 0.01))
    assert moit.transmittance(f, voxels())[-1] == 1
    assert moit.transmittance(f, Slices(128, warp="none"))[-1] < 2e-4


def test_a_slice_that_overflows_lets_nothing_through_whatever_the_order():
    depth, alpha = [0.2] * 8 + [0.8], [0.95] * 8 + [0.5]
    f = one_ray(depth, alpha)
    assert moit.transmittance(f, voxels(), cull_opaque=False)[-1] == 0
    assert moit.transmittance(f, Slices(128, warp="none"))[-1] > 0


def test_the_bias_passes_over_the_layer_just_in_front():
    """Two layers in cells side by side: the one behind is read in front of the other, or within."""
    depth = [0.5, 0.5 + 1.5 / 8192, 0.9]
    T = moit.transmittance(one_ray(depth, [0.8, 0.5, 0.5]), voxels())
    assert T[1] > 0.5
    exact = moit.transmittance(
        one_ray(depth, [0.8, 0.5, 0.5]), Slices(128, warp="none", cells=8192)
    )
    assert abs(exact[1] - 0.2) < 0.15


@pytest.mark.parametrize("family, value", [("layers", 10_000), ("clear", 0.01)])
def test_dials_of_the_lab_show_lost_layers(family, value):
    """Too much light on the mean of rays, which dropped fractions of steps leave right."""
    f = FAMILIES[family].case(value, 512, seed=0).f
    exact = moit.transmittance(f, "sorted")
    lost = np.mean(moit.transmittance(f, "avboit(resolution=1)") - exact)
    ours = abs(np.mean(moit.transmittance(f, "slices128") - exact))
    assert lost > 5 * ours
    assert family != "layers" or lost > 0.5


def off(family, value, technique):
    """How far transmittances are from the exact ones, of fragments that arrive at their depths."""
    f = FAMILIES[family].case(value, 256, seed=0).f
    exact = moit.transmittance(f, "sorted", cull_opaque=False)
    return np.abs(moit.transmittance(f, technique, cull_opaque=False) - exact)


@pytest.mark.parametrize(
    "family, easy, hard, published, ours",
    [
        ("thin", 0.05, 0.003, "avboit(resolution=1)", "slices128"),
        ("adjacent", 5e-4, 2e-4, "avboit(resolution=1)", "slices128(cells=8192)"),
        ("screen", 0.01, 0.9, "avboit", "slices128"),
        ("tilted", 0.0, 0.01, "avboit", "slices128(resolution=8,total='full')"),
    ],
)
def test_dials_show_what_goes_wrong_as_published(family, easy, hard, published, ours):
    assert np.percentile(off(family, easy, published), 99) < 0.15
    wrong = np.percentile(off(family, hard, published), 99)
    assert wrong > 0.2
    assert np.percentile(off(family, hard, ours), 99) < 0.3 * wrong


@pytest.mark.parametrize("published", ["avboit", "avboit(resolution=1)"])
def test_a_surface_darkens_itself_where_light_is_read_at_its_own_slices(published):
    """It hides nothing. Blocks have it nearer in one pixel than in another; so many slices nearer
    none of it is left, and with none it is before itself in any pixel."""
    own = f"{published[:-1]},slice_bias=0.0)" if published[-1] == ")" else "avboit(slice_bias=0.0)"
    assert off("tilted", 0.0, published).max() == 0
    assert off("tilted", 0.0, own).max() > 0.2
    assert (off("tilted", 0.01, published).max() > 0.2) == (published == "avboit")
    assert off("tilted", 0.01, "slices128").max() == 0


def test_nothing_gets_through_a_slice_that_holds_no_more():
    for value, full in ((5, False), (6, True)):
        f = FAMILIES["overflow"].case(value, 256, seed=0).f
        exact = moit.transmittance(f, "sorted")[4::5]
        published = moit.transmittance(f, "avboit(resolution=1)")[4::5]
        assert (published == 0).mean() > 0.9 if full else (published == 0).mean() < 0.5
        ours = moit.transmittance(f, "slices128")[4::5]
        assert (ours > 0).all() and abs(np.median(ours / exact) - 1) < 0.05
        order = np.arange(len(f)).reshape(-1, 5)[:, [3, 4, 0, 2, 1]].ravel()
        f = moit.Fragments(f.offsets, f.depth[order], f.alpha[order], depth_range=f.depth_range)
        again = moit.transmittance(f, "avboit(resolution=1)")[1::5]
        np.testing.assert_array_equal(again, published)


def test_weights_sum_to_what_is_covered_where_scaled_alone():
    def brightness(technique):
        found = moit.stability(
            technique, families=["thin", "screen"], precisions="float64", progress=False
        )
        return max(row.brightness for row in found.rows)

    assert brightness("avboit(normalize=False)") > 0.3
    assert brightness(["avboit", "slices128", "sorted"]) < 1e-6


def test_blocks_have_what_the_pixel_at_their_middle_has():
    f = moit.scenes.load("mixed", (32, 32))
    raster = moit.transmittance(f, "avboit")
    average = moit.transmittance(f, "avboit(low_resolution='average')")
    assert (raster != average).any()
    counts = np.diff(f.offsets).reshape(32, 32)
    kept = np.zeros((32, 32), bool)
    kept[4::8, 4::8] = True
    only = np.where(kept, counts, 0).ravel()
    taken = np.repeat(kept.ravel(), counts.ravel())
    middles = moit.Fragments(
        np.append(0, np.cumsum(only)),
        f.depth[taken],
        f.alpha[taken],
        f.color[taken],
        shape=(32, 32),
        depth_range=f.depth_range,
    )
    np.testing.assert_array_equal(moit.transmittance(middles, "avboit"), raster[taken])


def test_bits_of_a_pixel():
    assert AdaptiveVoxels().bits_per_pixel == 128 * 8 / 64 + 8
    assert AdaptiveVoxels(64, 16, 4).bits_per_pixel == 64 * 16 / 16 + 8


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"count": 1}, "count"),
        ({"bits": 4}, "bits"),
        ({"slice_bias": -1.0}, "slice_bias"),
        ({"filter": "quintic"}, "filter"),
        ({"low_resolution": "middle"}, "low_resolution"),
        ({"depth_range": "pixel"}, "resolution: expected 1"),
    ],
)
def test_options_that_are_none_are_refused(options, words):
    with pytest.raises(ValueError, match=words):
        AdaptiveVoxels(**options)


def test_cells_beside_marked_ones_count_among_those_that_slices_must_hold():
    """Five layers are 35 cells with their neighbours, of which 24 slices hold those joined by twos;
    what found no slice would go to the pixel behind."""
    depth = np.tile([0.1, 0.3, 0.5, 0.7, 0.9], 8)
    alpha = np.repeat(np.linspace(0.3, 0.6, 8), 5)
    f = moit.Fragments(5 * np.arange(9), depth, alpha, shape=(1, 8), depth_range=(0, 1))
    T = moit.transmittance(f, voxels(count=24))
    np.testing.assert_allclose(T, moit.transmittance(f, "sorted"), atol=4 / 255)
