"""Splats as fragments, held to a reading of the reference in NumPy and to rays."""

import itertools
import re
import subprocess
import sys

import numpy as np
import pytest
from readings import splats as splat_reading

import moit
from moit.geometry import rasterizer
from moit.geometry.drawing import Drawable
from moit.geometry.rasterizer import Picture
from moit.geometry.splats import CONVENTIONS, Splats, SplatsError
from moit.rendering import making

SIZE = (97, 61)
CAMERA = moit.Camera(eye=(0.3, 0.5, 2.5))
BACKGROUND = (0.1, 0.2, 0.3)


def some_splats(seed, count, degree=1, size=-3.0, **options):
    rng = np.random.default_rng(seed)
    return moit.Splats(
        rng.normal(size=(count, 3)) * 0.6,
        np.exp(rng.normal(size, 0.7, (count, 3))),
        rng.normal(size=(count, 4)),
        rng.uniform(0, 1, count),
        sh=rng.normal(size=(count, (degree + 1) ** 2, 3)) * 0.4,
        **options,
    )


SCENES = {
    "a few": (some_splats(1, 12), CAMERA),
    "many, opaque, with an end": (some_splats(2, 2500), CAMERA),
    "trained against aliasing": (some_splats(4, 600, size=-4.5, antialiased=True), CAMERA),
    "large, near and behind the eye": (
        some_splats(3, 200, size=-1.5),
        moit.Camera(eye=(0.1, 0.2, 0.4), fov_y=1.4),
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_sorted_splats_are_the_picture_of_the_reference(name):
    splats, camera = SCENES[name]
    f = moit.rasterize(splats, camera, SIZE)
    found = moit.composite(f, "sorted", background=BACKGROUND)[..., :3]
    expected, blended = splat_reading.picture(splats, camera, SIZE, BACKGROUND)
    np.testing.assert_allclose(found, expected, atol=1e-5)
    np.testing.assert_array_equal(np.diff(f.offsets).reshape(blended.shape), blended)


def test_small_antialiased_splats_are_fainter_than_others():
    splats, camera = SCENES["trained against aliasing"]
    alike = splats._with(antialiased=False)
    fainter, plain = (moit.rasterize(one, camera, SIZE).alpha.sum() for one in (splats, alike))
    assert fainter < 0.8 * plain
    assert splats.seen_by("exact").antialiased and splats[:2].antialiased
    exact = [moit.rasterize(one.seen_by("exact"), camera, SIZE) for one in (splats, alike)]
    np.testing.assert_array_equal(exact[0].alpha, exact[1].alpha)
    assert repr(splats[:2]) == "Splats(2, degree 1, convention '3dgs', antialiased)"


def test_all_there_are_is_what_is_seen_and_what_lies_behind():
    """Of "3dgs-all" the fragments of "3dgs" and those behind: the first of these would leave less
    than 1e-4, so that no more than 1e-2 comes to it."""
    splats, camera = SCENES["many, opaque, with an end"]
    seen = moit.rasterize(splats, camera, SIZE)
    every = moit.rasterize(splats.seen_by("3dgs-all"), camera, SIZE)
    assert len(every) > 1.15 * len(seen)
    for p in range(0, len(seen.counts.ravel()), 97):
        parts = [slice(f.offsets[p], f.offsets[p + 1]) for f in (seen, every)]
        last = seen.depth[parts[0]].max(initial=0)
        nearer = every.depth[parts[1]] < last
        others = np.setdiff1d(every.depth[parts[1]], seen.depth[parts[0]])
        np.testing.assert_array_equal(
            every.alpha[parts[1]][nearer], seen.alpha[parts[0]][seen.depth[parts[0]] < last]
        )
        assert (others >= last).all()
    pictures = [moit.composite(f, "sorted") for f in (seen, every)]
    np.testing.assert_allclose(pictures[0], pictures[1], atol=2e-2)


def test_many_opaque_splats_end_before_the_last():
    splats, camera = SCENES["many, opaque, with an end"]
    through = moit.total_transmittance(moit.rasterize(splats, camera, SIZE), "sorted")
    assert through.min() < 2e-4
    assert through.min() >= 1e-4


def along_rays(splats, camera, size):
    """Of each pixel and splat alpha and depth, by the least of a square along the ray."""
    width, height = size
    right, up, forward = camera.axes
    across, along = camera.scale(size)
    y, x = np.mgrid[:height, :width]
    slopes = (2 * (x + 0.5) / width - 1) / across, (1 - 2 * (y + 0.5) / height) / along
    rays = (slopes[0][..., None] * right + slopes[1][..., None] * up + forward).reshape(-1, 3)
    axes = splat_reading.rotation_matrices(splats.rotations.astype(float)) * splats.scales[:, None]
    inverse = np.linalg.inv(axes @ axes.transpose(0, 2, 1))
    middle = splats.means.astype(float) - camera.eye
    of_ray = np.einsum("pi,nij,pj->pn", rays, inverse, rays)
    mixed = np.einsum("pi,nij,nj->pn", rays, inverse, middle)
    square = np.einsum("ni,nij,nj->n", middle, inverse, middle) - mixed**2 / of_ray
    alpha = np.minimum(0.99, splats.opacities * np.exp(-0.5 * np.maximum(square, 0)))
    depth = mixed / of_ray
    there = (alpha >= 1 / 255) & (depth >= camera.near) & (middle @ forward >= camera.near)
    return np.where(there, alpha, 0), depth


@pytest.mark.parametrize("name", SCENES)
def test_exact_splats_are_what_rays_meet(name):
    splats, camera = SCENES[name]
    splats = splats[:200].seen_by("exact")
    f = moit.rasterize(splats, camera, SIZE)
    alpha, depth = along_rays(splats, camera, SIZE)
    counts = (alpha > 0).sum(axis=1)
    # what has 1/255 but for rounding may be there or not
    assert np.abs(counts - np.diff(f.offsets)).sum() <= 2e-4 * counts.sum()
    seen = 0
    for pixel in np.flatnonzero((counts > 0) & (counts == np.diff(f.offsets))):
        there = np.flatnonzero(alpha[pixel])
        some = slice(f.offsets[pixel], f.offsets[pixel + 1])
        np.testing.assert_allclose(f.alpha[some], alpha[pixel, there], rtol=1e-4, atol=2e-6)
        np.testing.assert_allclose(f.depth[some], depth[pixel, there], rtol=1e-3, atol=1e-4)
        seen += len(there)
    assert seen > 500


def test_neighbouring_pixels_see_neighbouring_depths_of_exact_splats_only():
    turned = [[np.cos(0.4), 0, np.sin(0.4), 0]]
    disc = moit.Splats([[0, 0, 0]], [[0.5, 0.5, 0.01]], turned, [0.9])
    flat = moit.rasterize(disc, CAMERA, SIZE).depth
    sloped = moit.rasterize(disc.seen_by("exact"), CAMERA, SIZE).depth
    assert flat.min() == flat.max()
    assert np.ptp(sloped) > 0.5


def test_a_disc_without_thickness_is_seen():
    for convention in CONVENTIONS:
        disc = moit.Splats(
            [[0, 0, 0]], [[0.5, 0.5, 0]], [[1, 0, 0, 0]], [0.9], convention=convention
        )
        assert len(moit.rasterize(disc, CAMERA, SIZE).alpha) > 100


def test_threads_and_instruction_sets_change_no_bit():
    splats, camera = SCENES["many, opaque, with an end"]
    for convention in CONVENTIONS:
        several = splats.seen_by(convention)
        one = moit.rasterize(several, camera, SIZE, threads=1)
        for threads in (2, 5):
            other = moit.rasterize(several, camera, SIZE, threads=threads)
            for name in ("offsets", "depth", "alpha", "color"):
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_rows_by_themselves_are_those_of_the_whole(convention):
    splats, camera = SCENES["many, opaque, with an end"]
    picture = Splats.begin([splats.seen_by(convention)], camera.frame(SIZE, 2))
    offsets, *whole = picture.rows(0, SIZE[1])
    assert picture.depths == (whole[0].min(), whole[0].max())
    np.testing.assert_array_equal(picture.samples, np.diff(offsets[:: SIZE[0]]))
    for top, bottom in [(20, 48), (0, 7), (7, 20), (48, 61), (33, 34)]:
        some, *parts = picture.rows(top, bottom)
        first, last = top * SIZE[0], bottom * SIZE[0]
        np.testing.assert_array_equal(some, offsets[first : last + 1] - offsets[first])
        for part, array in zip(parts, whole, strict=True):
            np.testing.assert_array_equal(part, array[offsets[first] : offsets[last]])


def test_fragments_stand_in_the_order_that_is_given():
    far_first = moit.Splats(
        [[0, 0, -1], [0, 0, 1]], [0.5, 0.5], [[1, 0, 0, 0]] * 2, [0.5, 0.6], colors=(1, 1, 1)
    )
    f = moit.rasterize(far_first, moit.Camera(), (3, 3))
    middle = slice(f.offsets[4], f.offsets[5])
    np.testing.assert_allclose(f.depth[middle], [4, 2])
    assert isinstance(far_first, Drawable)


def test_parts_stand_in_the_order_that_is_given_whatever_their_convention():
    """All of the first part of a pixel, then all of the second, and so on."""
    parts = [some_splats(seed, 30, size=-2.0) for seed in (5, 6, 7, 8)]
    parts[1] = parts[1].seen_by("exact")
    both = moit.rasterize(parts, CAMERA, SIZE)
    # of parts of one convention what those in front hide is not drawn: two and two are one
    alone = [moit.rasterize(some, CAMERA, SIZE) for some in (parts[0], parts[1], parts[2:])]
    np.testing.assert_array_equal(both.counts, sum(one.counts for one in alone))
    for p in np.flatnonzero(both.counts)[::37]:
        here = [one.depth[one.offsets[p] : one.offsets[p + 1]] for one in alone]
        np.testing.assert_array_equal(
            both.depth[both.offsets[p] : both.offsets[p + 1]], np.concatenate(here)
        )
    first, second = (moit.rasterize(one, CAMERA, SIZE) for one in parts[2:])
    for p in np.flatnonzero((first.counts > 0) & (second.counts > 0))[::5]:
        assert alone[2].depth[alone[2].offsets[p]] == first.depth[first.offsets[p]]


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_harmonics_of_all_degrees_are_those_of_the_reference(degree):
    rng = np.random.default_rng(degree)
    for _ in range(5):
        sh = rng.normal(size=(1, (degree + 1) ** 2, 3)) * 0.1
        eye = rng.normal(size=3) * 3 + 1
        lone = moit.Splats([[0, 0, 0]], [0.5], [[1, 0, 0, 0]], [0.9], sh=sh)
        found = moit.rasterize(lone, moit.Camera(eye=tuple(eye)), (3, 3)).color[0]
        expected = splat_reading.colors(lone, eye)[0]
        np.testing.assert_allclose(found, expected, atol=2e-6)


def test_points_enclose_all_that_is_seen():
    ball = moit.Splats([[1, 2, 3]], [0.25], [[1, 0, 0, 0]], [1])
    low, high = ball.points
    seen = 0.25 * np.sqrt(2 * np.log(255))  # where a 255th is left
    np.testing.assert_array_less(seen, (high - low) / 2)
    np.testing.assert_allclose((high - low) / 2, seen, rtol=1e-2)


@pytest.mark.parametrize("convention", ["3dgs", "exact"])
def test_what_lies_outside_the_range_of_the_camera_is_not_drawn(convention):
    places = [[0, 0, z] for z in (1.5, 0, -1, -4)]  # at distances 1.5, 3, 4 and 7
    splats = moit.Splats(places, [0.1] * 4, [[1, 0, 0, 0]] * 4, [0.5] * 4, convention=convention)
    f = moit.rasterize(splats, moit.Camera(near=2, far=5), (9, 9))
    np.testing.assert_allclose(np.unique(f.depth.round(1)), [3, 4], atol=0.1)


@pytest.mark.parametrize("length", [1e-300, 1e-30, 1, 1e30, 1e300])
def test_rotations_have_any_length(length):
    turn = np.array([[0.5, -0.5, 0.5, 0.5]])
    one = moit.Splats([[0, 0, 0]], [0.5], length * turn, [0.9])
    np.testing.assert_allclose(one.rotations, turn, rtol=1e-6)


def test_colours_depend_on_the_view_as_harmonics_say():
    sh = np.zeros((1, 4, 3))
    sh[0, 2] = 1  # of z
    lone = moit.Splats([[0, 0, 0]], [0.5], [[1, 0, 0, 0]], [0.9], sh=sh)
    seen = [
        moit.rasterize(lone, moit.Camera(eye=eye), (3, 3)).color.max()
        for eye in [(0, 0, 3), (0, 0, -3), (3, 0, 0)]
    ]
    np.testing.assert_allclose(seen, [0.5 - 0.4886025, 0.5 + 0.4886025, 0.5], atol=1e-6)


def test_splats_and_meshes_are_one_picture():
    splats, camera = SCENES["a few"]
    wall = moit.Mesh([[-9, -9, -0.2], [9, -9, -0.2], [0, 9, -0.2]], [[0, 1, 2]], (0.9, 0.2, 0.1))
    glass = moit.Mesh([[-9, -9, 0.3], [9, -9, 0.3], [0, 9, 0.3]], [[0, 1, 2]], alpha=0.4)
    scene = [splats, wall, splats.seen_by("exact"), glass]
    for technique in ("sorted", "power6", "wboit", "mlab4"):
        found = moit.render(scene, technique, SIZE, camera=camera)
        expected = moit.composite(moit.rasterize(scene, camera, SIZE), technique)
        np.testing.assert_array_equal(found, expected)
    alone = moit.render([splats], "sorted", SIZE, camera=camera)
    both = moit.render(scene, "sorted", SIZE, camera=camera)
    assert np.abs(both - alone)[..., :3].max() > 0.2


BAD = {
    "means": ([[0, 0]], "means: expected shape \\(N, 3\\), got \\(1, 2\\)"),
    "scales": ([[1, -1, 1]], r"scales\[0, 1\]: found -1; needed a number that is not negative"),
    "rotations": ([[0, 0, 0, 0]], r"rotations\[0, 0\]: found 0; needed a quaternion"),
    "opacities": ([1.5], r"opacities\[0\]: found 1.5; needed a number in \[0, 1\]"),
}


@pytest.mark.parametrize("name", BAD)
def test_arguments_are_checked(name):
    good = {
        "means": [[0, 0, 0]],
        "scales": [[1, 1, 1]],
        "rotations": [[1, 0, 0, 0]],
        "opacities": [0.5],
    }
    value, said = BAD[name]
    with pytest.raises(moit.SplatsError, match=said):
        moit.Splats(**good | {name: value})
    with pytest.raises(moit.SplatsError, match=f"{name}.*: found nan; needed a finite"):
        moit.Splats(**good | {name: np.full(np.shape(good[name]), np.nan)})
    with pytest.raises(moit.SplatsError, match=f"{name}: expected shape"):
        moit.Splats(**good | {name: np.zeros((2, 2, 2))})


def test_colours_are_given_once_and_conventions_are_two():
    arrays = ([[0, 0, 0]], [1], [[1, 0, 0, 0]], [0.5])
    with pytest.raises(TypeError, match="colors: needed None where sh is given"):
        moit.Splats(*arrays, colors=(1, 1, 1), sh=np.zeros((1, 1, 3)))
    with pytest.raises(moit.SplatsError, match=r"sh: expected shape \(1, 1, 3\) or \(1, 4, 3\)"):
        moit.Splats(*arrays, sh=np.zeros((1, 5, 3)))
    with pytest.raises(TypeError, match="colors: found unsigned integers; needed real numbers"):
        moit.Splats(*arrays, colors=np.uint8([[255, 128, 0]]))
    with pytest.raises(moit.SplatsError, match=r"colors\[1\]: found -1"):
        moit.Splats(*arrays, colors=(1, -1, 1))
    with pytest.raises(
        moit.SplatsError, match="convention: expected '3dgs', 'exact', '3dgs-all', got 'gsplat'"
    ):
        moit.Splats(*arrays, convention="gsplat")
    with pytest.raises(moit.SplatsError, match="scales: found numbers beyond what float32 holds"):
        moit.Splats([[0, 0, 0]], [1e300], [[1, 0, 0, 0]], [0.5])


def test_splats_that_draw_lots_are_the_sorted_picture_in_the_mean():
    """As StochasticSplats has it: noise falls as the root of the count of draws, and no bias is
    left; what scales colours to exact coverage has less noise, and some bias."""
    splats, camera = SCENES["large, near and behind the eye"]
    f = moit.rasterize(splats.seen_by("3dgs-all"), camera, (48, 32))
    exact = moit.composite(f, "sorted", background=BACKGROUND)

    def off(seeds):
        drawn = (moit.Stochastic(4, seed=k, stratified=False, normalize=False) for k in seeds)
        pictures = [moit.composite(f, one, background=BACKGROUND) for one in drawn]
        return np.mean(pictures, axis=0) - exact

    one, many = off([1]), off(range(1, 17))
    assert 0.2 < np.sqrt((many**2).mean() / (one**2).mean()) < 0.3
    assert abs(many.mean()) < 2e-3


def test_no_splats_are_an_empty_picture():
    none = moit.Splats(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 4)), np.zeros(0))
    assert len(moit.rasterize(none, CAMERA, SIZE).depth) == 0


LOCAL = (
    "sorted",
    "power6",
    "wboit",
    "mlab4",
    "hybrid4",
    "stochastic8",
    "adaptive8",
    "trigonometric4",
)
WALL = moit.Mesh([[-9, -9, -0.2], [9, -9, -0.2], [0, 9, -0.2]], [[0, 1, 2]], (0.9, 0.2, 0.1))
GLASS = moit.Mesh(
    [[-9, -9, 0.3], [9, -9, 0.3], [0, 9, 0.3]], [[0, 1, 2]], alpha=0.4, transmission=0.5
)


@pytest.mark.parametrize("technique", [*LOCAL, "power4(resolution=4)"])
@pytest.mark.parametrize("most", [5000, 70_000])
def test_bands_are_the_rows_of_the_whole(technique, most, monkeypatch):
    splats, camera = SCENES["many, opaque, with an end"]
    background = np.random.default_rng(5).random((*SIZE[::-1], 3))
    made = []
    rows = Picture.rows
    monkeypatch.setattr(Picture, "rows", lambda *args: made.append(args[1:]) or rows(*args))
    for scene in ([splats], [splats.seen_by("exact"), WALL, splats[::3], GLASS]):
        if len(scene) > 1 and not moit.technique(technique).supports_transmission:
            scene = scene[:3]
        expected = moit.composite(
            moit.rasterize(scene, camera, SIZE), technique, background=background
        )
        made.clear()
        monkeypatch.setattr(making, "MOST_AT_ONCE", most)
        found = moit.render(scene, technique, SIZE, camera=camera, background=background)
        np.testing.assert_array_equal(found, expected)
        if moit.technique(technique).local:
            assert len(made) > 2
            assert made[0][0] == 0
            assert made[-1][1] == SIZE[1]
            assert all(one[1] == after[0] for one, after in itertools.pairwise(made))
        else:
            assert made == [(0, SIZE[1])]


def test_bands_end_where_tiles_do_if_they_can():
    splats, camera = SCENES["many, opaque, with an end"]
    picture = Picture([splats], camera, camera.frame(SIZE, 2))
    total = picture.parts[0].samples
    assert picture.bands(int(total.sum())) == [(0, 61)]
    assert picture.bands(int(total[:40].sum())) == [(0, 32), (32, 61)]
    assert picture.bands(1) == [(row, row + 1) for row in range(61)]
    assert Picture([WALL], camera, camera.frame(SIZE, 2)).bands(1) == [(0, 61)]


def test_memory_is_that_of_a_band():
    """In a process of its own, whose height is asked before and after."""
    program = """
import re, moit
from moit.rendering import making

def height():
    return int(re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1])

scene = moit.scenes.splats("fog-splats", 20_000)
moit.render(scene.splats[:200], "power4", (64, 36), camera=scene.camera, threads=2)
before, making.MOST_AT_ONCE = height(), 1 << 18
made = moit.render(
    scene.splats, "power4", (320, 180), camera=scene.camera, threads=2, report=True
)
banded = height() - before
f = moit.rasterize(scene.splats, scene.camera, (320, 180), threads=2)
print(banded, height() - before, made.memory["fragments"], 20 * len(f))
"""
    out = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    banded, whole, held, of_all = map(int, re.findall(r"\d+", out.stdout))
    assert of_all > 80_000_000
    assert held < 20 * (1 << 18) + 8 * (320 * 180 + 1)
    assert banded < 50_000
    assert whole > of_all / 1024  # which is seen, then


def test_bands_have_the_range_of_the_whole(monkeypatch):
    """Rounding may put a splat beyond the ends of the range, which is then wider: of all bands."""
    means, camera = [[0, 0.4, 0.5], [0, -0.4, -0.5]], moit.Camera()
    splats = Splats(means, [0.05, 0.05], [[1, 0, 0, 0]] * 2, [0.9, 0.9])
    found = moit.rasterize(splats, camera, SIZE)
    least, most = float(found.depth.min()), float(found.depth.max())
    near, far = least * (1 + 4e-7), most * (1 - 4e-7)
    monkeypatch.setattr(rasterizer, "transparent_range", lambda *_: (near, far))
    picture = Picture([splats], camera, camera.frame(SIZE, 1))
    bands = [picture.rows(top, min(top + 16, SIZE[1])) for top in range(0, SIZE[1], 16)]
    assert {len(np.unique(band.depth)) for band in bands} == {0, 1}
    assert {band.depth_range for band in bands} == {(least, most)}
    assert moit.rasterize(splats, camera, SIZE).depth_range == (least, most)


def test_splats_of_a_flat_convention_are_not_thick():
    with pytest.raises(SplatsError, match="thick: found True"):
        moit.Splats(
            [[0.0] * 3], [[1.0] * 3], [[1.0, 0, 0, 0]], [0.5], colors=(0.5, 0.5, 0.5), thick=True
        )
