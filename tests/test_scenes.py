"""Scenes: what makes each of them what it is."""

import numpy as np
import pytest

import moit
from moit import scenes
from moit.scenes.formulas import HAIR_ALPHA, SPHERE_RADIUS

NAMES = [
    "panes",
    "cloud",
    "hair",
    "spheres",
    "neural-training",
    "stained-glass",
    "squares",
    "mixed",
]
MESHES = [
    "teapots",
    "spheres-mesh",
    "foliage",
    "smoke",
    "grass",
    "strands",
    "ship-like",
    "ship-in-clouds",
    "burning-house",
    "grass-and-smoke",
    "engine",
    "chess",
    "pond",
    "cloud-with-disk",
]
PICTURES = [name for name in NAMES if name != "neural-training"]  # the others are noise


@pytest.fixture(scope="module", params=[0, 1], ids=["seed0", "seed1"])
def seed(request):
    return request.param


def loaded(name, seed, size=(160, 120)):
    return scenes.load(name, size, seed)


def pixel_of(f):
    return np.repeat(np.arange(len(f.counts)), f.counts)


def test_names_are_those_of_the_scenes():
    assert scenes.names() == NAMES + MESHES


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (2, 3), (33, 17)])
def test_every_size_is_drawn(name, size):
    f = scenes.load(name, size)
    assert f.shape == size[::-1] and f.origin == (0, 0)
    for array in (f.depth, f.alpha, f.color):
        assert array.dtype == np.float32
    # Logarithmic warps need depths, and a range, above 0.
    assert f.depth_range[0] > 0 and (len(f) == 0 or f.depth.min() > 0)
    assert (f.color >= 0).all()


@pytest.mark.parametrize("name", NAMES)
def test_the_same_seed_gives_the_same_bits(name):
    f, g, other = (loaded(name, seed, (48, 40)) for seed in (3, 3, 4))
    for array in ("offsets", "depth", "alpha", "color"):
        assert np.array_equal(getattr(f, array), getattr(g, array))
    assert not np.array_equal(f.color, other.color)


@pytest.mark.parametrize("name", PICTURES)
def test_another_size_shows_the_same_picture(name, seed):
    # A third of a pixel's side is the same point, where the parts of "mixed" begin at integers.
    small, large = loaded(name, seed, (100, 60)), loaded(name, seed, (300, 180))
    columns = 92 if name == "mixed" else 100  # the rest of "mixed" is noise
    a = small.counts.reshape(60, 100)[:, :columns]
    b = large.counts.reshape(180, 300)[1::3, 1::3][:, :columns]
    assert a.sum() > 1000
    # Centres on an edge fall to either side of it with the last bit.
    assert (a != b).mean() < 2e-3
    for y, x in np.argwhere((a == b) & (a > 0))[::50].tolist():
        one, same = small[y, x], large[3 * y + 1, 3 * x + 1]
        np.testing.assert_allclose(one.depth, same.depth, rtol=1e-5)
        np.testing.assert_allclose(one.color, same.color, atol=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_fragments_arrive_unsorted(name, seed):
    f = loaded(name, seed)
    behind = np.diff(f.depth)[np.diff(pixel_of(f)) == 0]
    assert (behind < 0).any() and (behind > 0).any()


def test_stained_glass_colours_the_light_behind_it(seed):
    f = loaded("stained-glass", seed)
    t = f.transmission
    assert f.counts.min() >= 2 and f.counts.max() < 24
    filters = np.ptp(t, axis=1) > 0.2  # they differ in what they let through
    assert 0.1 < filters.mean() < 0.9
    assert (f.alpha[filters] >= 0.9).all() and (f.color[filters].max(axis=1) < 0.7).all()
    leads = f.depth == np.float32(5)
    assert (f.alpha[leads] == 1).all() and (t[leads].max(axis=1) > 0).mean() > 0.1
    # Every pixel has something opaque, which is the wall, lead, a rim or at last the sky.
    opaque = (f.alpha == 1) & (t == 0).all(axis=1)
    assert (np.bincount(pixel_of(f)[opaque], minlength=len(f.counts)) >= 1).all()
    # Where reflections lie behind other discs or dust, order matters to the picture.
    exact, drawn = (moit.composite(f, name)[..., :3] for name in ("sorted", "unsorted"))
    assert (np.abs(exact - drawn).max(axis=2) > 0.05).mean() > 0.005
    # What comes through glass has its colour, brighter than what it reflects.
    assert (np.ptp(exact, axis=2) > 0.3).mean() > 0.1
    grey = moit.Fragments(f.offsets, f.depth, f.coverage, f.color, shape=f.shape)
    assert (np.ptp(moit.composite(grey, "sorted")[..., :3], axis=2) > 0.3).mean() < 0.05


def test_other_scenes_have_no_transmission(seed):
    for name in NAMES:
        assert (loaded(name, seed, (8, 6)).transmission is None) == (name != "stained-glass")


def test_panes_are_few_and_have_an_opaque_frame(seed):
    f = loaded("panes", seed)
    assert f.counts.max() <= 8 and f.counts.max() >= 5
    assert np.median(f.counts[f.counts > 0]) <= 3
    opaque = f.alpha == 1
    assert 0.01 < opaque.mean() < 0.2
    assert f.alpha.min() >= 0.4  # glass that one sees
    # The frame is drawn first, and panes are before and behind it.
    frame = np.full(len(f.counts), np.nan)
    frame[pixel_of(f)[opaque]] = f.depth[opaque]
    assert opaque[f.offsets[:-1][~np.isnan(frame)]].all()
    others = (f.depth - frame[pixel_of(f)])[~opaque]
    assert (others < 0).any() and (others > 0).any()


def test_panes_intersect(seed):
    f = loaded("panes", seed, (320, 240))
    # Where two panes cross, those that a pixel and its right neighbour both meet change places,
    # with a difference of depth that goes through 0.
    swaps = 0
    for n in range(2, f.counts.max() + 1):
        both = np.flatnonzero((f.counts[1:] == n) & (f.counts[:-1] == n))
        here, there = (f.depth[f.offsets[both + k][:, None] + np.arange(n)] for k in (0, 1))
        for i in range(n):
            for j in range(i):
                a, b = here[:, i] - here[:, j], there[:, i] - there[:, j]
                swaps += ((a * b < 0) & (np.abs(a - b) < 0.05)).sum()
    assert swaps > 20


def test_the_cloud_has_a_red_disk_of_94_percent(seed):
    f = loaded("cloud", seed)
    disk = f.alpha == np.float32(0.94)
    assert disk.sum() > 100 and f.alpha[~disk].max() < 0.2
    assert (f.color[disk, 0] > 5 * f.color[disk, 1]).all()
    pixel = pixel_of(f)
    assert len(set(pixel[disk])) == disk.sum()  # one layer
    assert (pixel[disk] % 160).max() < 80  # in the left part
    # with particles before it and behind it
    depth = np.full(len(f.counts), np.nan)
    depth[pixel[disk]] = f.depth[disk]
    difference = (f.depth - depth[pixel])[~disk & ~np.isnan(depth[pixel])]
    assert 0.02 < (difference < 0).mean() < 0.5


def test_the_cloud_is_dense_and_soft(seed):
    f = loaded("cloud", seed)
    assert f.counts.max() > 60
    assert f.alpha.min() < 1e-3


def test_hair_is_of_one_alpha_and_above_a_hundred_fragments(seed):
    f = loaded("hair", seed)
    assert set(f.alpha.tolist()) == {float(np.float32(HAIR_ALPHA))}
    assert f.counts.max() > 100
    assert (f.counts > 50).mean() > 0.1


def test_hair_comes_in_clusters_of_depth(seed):
    f = loaded("hair", seed).sorted()
    for pixel in np.argsort(f.counts)[-20:]:
        gaps = np.diff(f.depth[f.offsets[pixel] : f.offsets[pixel + 1]])
        assert np.sort(gaps)[-3] > 10 * np.median(gaps)


def test_spheres_have_two_surfaces_each_and_a_large_range(seed):
    f = loaded("spheres", seed)
    assert set(f.counts.tolist()) == {0, 2, 4, 6}
    assert set(f.alpha.tolist()) == {float(np.float32(0.6))}
    near, far = f.depth_range
    assert far - near > 10 * SPHERE_RADIUS
    assert near < f.depth.min() and f.depth.max() < far
    back, front = f.depth[::2], f.depth[1::2]  # drawn in this order
    thickness = back - front
    assert thickness.min() >= 0
    # seen from the middle a sphere is at most its diameter thick
    assert 1.9 * SPHERE_RADIUS < thickness.max() < 2.001 * SPHERE_RADIUS


def test_all_spheres_intersect(seed):
    f = loaded("spheres", seed)
    six = f.offsets[:-1][f.counts == 6]
    back, front = (f.depth[six[:, None] + np.arange(k, 6, 2)] for k in (0, 1))
    common = np.minimum.reduce(back, axis=1) > np.maximum.reduce(front, axis=1)
    assert common.any()  # a point that is in all three
    assert len(np.unique(np.argsort(front, axis=1), axis=0)) >= 3  # which is in front changes


def test_neural_training_has_the_distribution_of_the_paper(seed):
    f = loaded("neural-training", seed)
    assert (f.counts.min(), f.counts.max()) == (2, 32)
    assert abs(f.counts.mean() - 17) < 0.3  # 9 / sqrt(19200) is .065
    assert f.alpha.min() >= np.float32(0.1) and f.alpha.max() <= np.float32(0.5)
    assert abs(f.alpha.mean() - 0.3) < 0.01
    assert f.depth_range == (1, 2)
    extent = np.maximum.reduceat(f.depth, f.offsets[:-1]) - np.minimum.reduceat(
        f.depth, f.offsets[:-1]
    )
    assert extent.min() >= 0.3 - 1e-6 and extent.max() <= 1  # depths are rounded to 1.2e-7
    assert abs(extent.mean() - 0.65) < 0.01
    assert np.abs(f.color.mean(axis=0) - 0.5).max() < 0.01


def test_mixed_has_few_layers_mostly_and_all_the_rest(seed):
    f = loaded("mixed", seed, (320, 180))
    assert np.median(f.counts) <= 2
    assert 0.1 < (f.counts == 0).mean() < 0.6
    assert (f.counts[f.counts > 0] <= 4).mean() > 0.6
    assert f.counts.max() > 100
    assert 0.1 < ((f.alpha == 1).sum() / len(f.counts)) < 0.6
    for alpha in (HAIR_ALPHA, 0.6, 0.94):
        assert (f.alpha == np.float32(alpha)).any()


@pytest.mark.parametrize(
    "name, message",
    [
        ("pane", "no scene 'pane'; did you mean 'panes'"),
        ("Hair", "did you mean 'hair'"),
        ("", "known: panes, cloud"),
    ],
)
def test_unknown_names_raise_with_the_nearest(name, message):
    with pytest.raises(ValueError, match=message):
        scenes.load(name)


@pytest.mark.parametrize("name", [None, 3, b"panes", ["panes"]])
def test_what_is_no_name_is_refused(name):
    with pytest.raises(TypeError, match="name: expected the name of a scene"):
        scenes.load(name)


@pytest.mark.parametrize(
    "size, error",
    [
        ((0, 5), ValueError),
        ((5, -1), ValueError),
        ((2**16, 2**16), ValueError),
        ((10**30, 1), ValueError),
        ((5,), TypeError),
        ((5, 5, 5), TypeError),
        ((5.0, 5), TypeError),
        (5, TypeError),
        (None, TypeError),
        ("55", TypeError),
    ],
)
def test_bad_sizes_are_refused(size, error):
    with pytest.raises(error, match="size: expected"):
        scenes.load("panes", size)


@pytest.mark.parametrize("seed, error", [(-1, ValueError), (0.5, TypeError), (None, TypeError)])
def test_bad_seeds_are_refused(seed, error):
    with pytest.raises(error, match="seed: expected an integer"):
        scenes.load("panes", (4, 4), seed)


def test_numpy_integers_are_taken():
    f = scenes.load("panes", np.array([8, 6]), np.int64(2**40))
    assert f.shape == (6, 8)


def test_a_scene_may_be_given_by_name():
    assert moit.composite("spheres", "sorted").shape == (360, 640, 4)


@pytest.fixture(scope="module", params=MESHES)
def triangles(request):
    return request.param, scenes.meshes(request.param, seed=0)


def test_scenes_of_triangles_have_opaque_and_transparent_ones(triangles):
    name, scene = triangles
    glass = np.concatenate([mesh.transparent for mesh in scene.meshes])
    assert glass.sum() > 4000
    assert (~glass).any() == (name != "spheres-mesh")


def test_scenes_of_triangles_are_drawn_unsorted(triangles):
    name, scene = triangles
    f = scenes.load(name, (160, 90))
    assert f.shape == (90, 160) and f.depth_range[0] > 0
    np.testing.assert_array_equal(
        f.depth, moit.rasterize(scene.meshes, scene.camera, (160, 90)).depth
    )
    behind = np.diff(f.depth)[np.diff(pixel_of(f)) == 0]
    assert (behind < 0).mean() > 0.05 and (behind > 0).mean() > 0.05
    assert f.counts.max() >= 6
    assert (f.counts > 1).mean() > 0.05  # glass is seen in a good part of the picture


def test_the_seed_moves_the_triangles(triangles):
    name, scene = triangles
    same, other = scenes.meshes(name, 0), scenes.meshes(name, 1)
    for one, again in zip(scene.meshes, same.meshes, strict=True):
        np.testing.assert_array_equal(one.vertices, again.vertices)
    moved = [
        not np.array_equal(one.vertices, another.vertices)
        for one, another in zip(scene.meshes, other.meshes, strict=True)
    ]
    assert any(moved)


def test_seventeen_pots_overlap_toward_the_middle():
    f = scenes.load("teapots", (320, 180))
    counts = f.counts.reshape(180, 320)
    assert counts[:, 140:180].max() > 20 > counts[:, :40].max()


def test_leaves_are_opaque_soft_and_clear():
    f = scenes.load("foliage", (320, 180))
    green = f.color[:, 1] > 1.5 * f.color[:, 0]
    alpha = f.alpha[green]
    assert (alpha == 1).any() and (alpha == 0).any() and ((alpha > 0.2) & (alpha < 0.8)).any()


@pytest.mark.parametrize("name", ["panes", "nothing"])
def test_what_is_no_scene_of_triangles_says_so(name):
    with pytest.raises(ValueError, match="there is no scene of triangles"):
        scenes.meshes(name)
