"""Deep images as points in space, and as moments in a flat file."""

import numpy as np
import pytest

import moit
from moit.__main__ import main

CAMERA = moit.Camera(eye=(1.0, 2.0, 6.0), target=(0.2, 0.1, -0.3), up=(0.1, 1.0, 0.0), fov_y=0.9)
POINT = np.dtype([(name, "<f4") for name in "xyz"] + [(name, "u1") for name in "rgba"])


def points_of(path):
    head, _, rest = path.read_bytes().partition(b"end_header\n")
    assert head.startswith(b"ply\nformat binary_little_endian 1.0\n")
    points = np.frombuffer(rest, POINT)
    (count,) = (line.split()[2] for line in head.splitlines() if line.startswith(b"element"))
    assert int(count) == len(points)
    return points


def cloud(frame):
    """A point a pixel, from (y, x) = (2, 3) on, at depths that all differ."""
    n = 12
    depth = np.linspace(3, 8, n).astype(np.float32)
    color = np.linspace(0, 1, 3 * n).reshape(n, 3).astype(np.float32)
    alpha = np.linspace(0.3, 1, n).astype(np.float32)
    ends = np.arange(n + 1)
    return moit.Fragments(ends, depth, alpha, color, shape=(3, 4), origin=(2, 3), frame=frame)


@pytest.mark.parametrize("from_header", [False, True])
def test_points_project_to_their_pixels(tmp_path, from_header):
    """By the camera's own matrices; a header says the same in rows, with z along the view."""
    size = (10, 8)
    view, projection = CAMERA.matrices(size)
    to_camera = np.diag([1.0, 1, -1, 1]) @ view
    attributes = tuple(
        moit.fragments.frame.Attribute(
            name.encode(), b"m44f", np.ascontiguousarray(matrix.T, "<f4").tobytes()
        )
        for name, matrix in (("worldToCamera", to_camera), ("worldToNDC", projection @ view))
    )
    f = cloud(moit.Frame((8, 10), attributes=attributes if from_header else ()))
    moit.write_deep(tmp_path / "a.exr", f)
    given = None if from_header else CAMERA
    assert moit.deep.to_points(tmp_path / "a.exr", tmp_path / "a.ply", given) == 12
    points = points_of(tmp_path / "a.ply")
    world = np.stack([points[name] for name in "xyz"] + [np.ones(12)])
    clip = projection @ view @ world
    x, y = (clip[0] / clip[3] + 1) * 5, (1 - clip[1] / clip[3]) * 4
    row, column = np.divmod(np.arange(12), 4)
    assert np.abs(x - (column + 3.5)).max() < 1e-4 and np.abs(y - (row + 2.5)).max() < 1e-4
    assert np.abs((to_camera @ world)[2] - f.depth).max() < 1e-4
    found = np.stack([points[name] for name in "rgb"], axis=1)
    wanted = np.where(f.color <= 0.0031308, 12.92 * f.color, 1.055 * f.color ** (1 / 2.4) - 0.055)
    assert np.abs(found - 255 * wanted).max() < 1
    assert np.abs(points["a"] - 255 * f.alpha).max() < 1


def test_points_of_volumes_wide_pixels_and_coloured_alphas(tmp_path):
    f = moit.Fragments(
        [0, 2, 4],
        np.float32([2, 4, 6, 8]),
        np.float32([0.5, 1, 0, 0.9]),
        np.float32([(0.2, 0.4, 0.2)] * 4),
        transmission=np.float32([(0, 0.3, 0.6)] * 4),
        back=np.float32([4, 4, 7, 8]),
        shape=(1, 2),
        frame=moit.Frame((1, 2), pixel_aspect=2.0),
    )
    moit.write_deep(tmp_path / "a.exr", f, half=False)
    camera = moit.Camera(eye=(0, 0, 0), target=(0, 0, -1), fov_y=np.pi / 2)
    moit.deep.to_points(tmp_path / "a.exr", tmp_path / "a.ply", camera)
    points = points_of(tmp_path / "a.ply")
    np.testing.assert_allclose(points["z"], [-3, -4, -6.5, -8])  # middles
    # Two pixels, twice as wide as high: their middles lie one height from that of the picture.
    np.testing.assert_allclose(points["x"] / -points["z"], [-2, -2, 2, 2], rtol=1e-6)
    assert np.abs(points["y"]).max() == 0
    color = (0.2, 0.4 / 0.7, 0.2 / 0.4)  # each by the alpha of its channel
    srgb = [round(255 * (1.055 * c ** (1 / 2.4) - 0.055)) for c in color]
    for k in (0, 1, 3):  # what has no alpha has no colour
        assert [points[name][k] for name in "rgb"] == srgb
    assert points["a"].tolist() == [round(255 * a * 0.7) for a in (0.5, 1, 0, 0.9)]
    seen = moit.deep.to_points(tmp_path / "a.exr", tmp_path / "a.ply", camera, least_alpha=0.6)
    assert seen == 2  # of the means of alphas


def test_headers_may_hold_any_projection(tmp_path):
    f = cloud(None)
    rng = np.random.default_rng(1)
    to_camera, to_screen = rng.normal(size=(4, 4)), rng.normal(size=(4, 4))
    to_camera[:, 3] = (0, 0, 0, 1)
    attributes = tuple(
        moit.fragments.frame.Attribute(name.encode(), b"m44f", matrix.astype("<f4").tobytes())
        for name, matrix in (("worldToCamera", to_camera), ("worldToNDC", to_screen))
    )
    frame = moit.Frame((8, 10), attributes=attributes)
    moit.write_deep(tmp_path / "a.exr", cloud(frame))
    moit.deep.to_points(tmp_path / "a.exr", tmp_path / "a.ply")
    points = points_of(tmp_path / "a.ply")
    world = np.stack([points[name] for name in "xyz"] + [np.ones(12)], axis=1)
    clip = world @ to_screen
    row, column = np.divmod(np.arange(12), 4)
    np.testing.assert_allclose((clip[:, 0] / clip[:, 3] + 1) * 5, column + 3.5, atol=1e-2)
    np.testing.assert_allclose((1 - clip[:, 1] / clip[:, 3]) * 4, row + 2.5, atol=1e-2)
    np.testing.assert_allclose((world @ to_camera)[:, 2], f.depth, atol=1e-3)


def test_points_without_a_camera_or_of_little_alpha(tmp_path):
    moit.write_deep(tmp_path / "a.exr", cloud(None))
    with pytest.raises(moit.FragmentsError, match="has no worldToCamera"):
        moit.deep.to_points(tmp_path / "a.exr", tmp_path / "a.ply")
    assert not (tmp_path / "a.ply").exists()
    few = moit.deep.to_points(tmp_path / "a.exr", tmp_path / "a.ply", CAMERA, least_alpha=0.65)
    assert few == 6 == len(points_of(tmp_path / "a.ply"))
    assert moit.deep.to_points(tmp_path / "a.exr", tmp_path / "a.ply", CAMERA, least_alpha=1) == 1
    with pytest.raises(ValueError, match="least_alpha: expected a number in"):
        moit.deep.to_points(tmp_path / "a.exr", tmp_path / "a.ply", CAMERA, least_alpha=2)


@pytest.mark.parametrize("name", ["power4", "power8", "trig3"])
def test_moments_in_a_file_prove_what_transmittance_is(tmp_path, name):
    f = moit.scenes.load("mixed", (24, 16))
    moit.write_deep(tmp_path / "a.exr", f)
    f = moit.read_deep(tmp_path / "a.exr")
    moit.deep.to_moments(tmp_path / "a.exr", tmp_path / "m.exr", name)
    found = moit.deep.read_moments(tmp_path / "m.exr")
    assert str(found.technique) == name and found.depth_range == f.depth_range
    b0, b = moit.moments.gather(f, name, dtype="f4")
    assert np.array_equal(found.b0.ravel(), b0)
    assert np.array_equal(found.b.reshape(b.shape), b)
    depth = np.linspace(f.depth_range[0] - 1, f.depth_range[1] + 1, 31)
    lower, upper = found.bounds(depth)
    true = moit.transmittance(f, "sorted", depth, dtype="f8")
    assert (lower <= true + 1e-6).all() and (true <= upper + 1e-6).all()
    assert (upper - lower).mean() < 0.5
    estimate = found.transmittance(depth)
    assert np.abs(estimate - true).mean() < 0.1


def test_moments_know_where_they_end_and_where_they_lie(tmp_path):
    attribute = moit.fragments.frame.Attribute(b"owner", b"string", b"somebody")
    f = moit.Fragments(
        [0, 3],
        np.float32([1, 2, 4]),
        np.float32([0.5, 1, 0.5]),
        shape=(1, 1),
        origin=(2, 3),
        frame=moit.Frame((8, 9), pixel_aspect=2.0, attributes=(attribute,)),
    )
    moit.write_deep(tmp_path / "a.exr", f)
    moit.deep.to_moments(tmp_path / "a.exr", tmp_path / "m.exr", "power4")
    found = moit.deep.read_moments(tmp_path / "m.exr")
    assert found.origin == (2, 3) and found.frame.display_shape == (8, 9)
    assert found.frame.metadata["owner"] == "somebody" and found.frame.pixel_aspect == 2.0
    # In front of a depth is what is nearer, not what is there; depths may lie anywhere.
    depth = [-1e30, -1, 0, 0.5, 2, np.nextafter(2, 3), 1e30]
    lower, upper = (one[0, 0] for one in found.bounds(depth))
    seen = found.transmittance(depth)[0, 0]
    np.testing.assert_allclose(lower[4:], [0.5, 0, 0], atol=1e-3)
    np.testing.assert_allclose(upper[4:], [0.5, 0, 0], atol=1e-3)
    assert (upper[:4] == 1).all() and np.isfinite(seen).all() and (seen[-2:] == 0).all()


def test_moments_of_bands_are_those_of_the_whole(tmp_path):
    f = moit.scenes.load("hair", (96, 64))
    moit.write_deep(tmp_path / "a.exr", f)
    for memory in (1 << 20, 1 << 30):
        moit.deep.to_moments(tmp_path / "a.exr", tmp_path / f"{memory}.exr", memory=memory)
    one, other = (moit.deep.read_moments(tmp_path / f"{m}.exr") for m in (1 << 20, 1 << 30))
    assert np.array_equal(one.b, other.b) and one.depth_range == other.depth_range


def test_what_is_no_file_of_moments_is_refused(tmp_path):
    moit.write_image(tmp_path / "a.exr", np.ones((2, 3, 3)))
    with pytest.raises(moit.FragmentsError, match="not a file that"):
        moit.deep.read_moments(tmp_path / "a.exr")
    moit.write_deep(tmp_path / "b.exr", cloud(None))
    for name in ("wboit", "power4-16"):
        with pytest.raises(ValueError, match="technique: expected one that stores moments"):
            moit.deep.to_moments(tmp_path / "b.exr", tmp_path / "c.exr", name)


def test_the_shell_writes_points_and_moments(tmp_path, capsys):
    a, ply, out = (str(tmp_path / name) for name in ("a.exr", "a.ply", "m.exr"))
    moit.write_deep(a, cloud(None))
    where = ["--eye", "1,2,6", "--target", "0.2,0.1,-0.3", "--up", "0.1,1,0", "--fov", "51.5662"]
    assert main(["to-points", a, "-o", ply, *where]) == 0
    assert capsys.readouterr().out == f"{ply}: 12 points\n"
    points = points_of(tmp_path / "a.ply")
    moit.deep.to_points(a, ply, CAMERA)
    other = points_of(tmp_path / "a.ply")
    assert max(np.abs(points[name] - other[name]).max() for name in "xyz") < 1e-4
    assert main(["to-moments", a, "-o", out, "-t", "power6"]) == 0
    assert moit.deep.read_moments(out).b.shape == (3, 4, 6)
    for verb in ("to-points", "to-moments", "curve", "inspect"):
        with pytest.raises(SystemExit):
            main([verb, "--help"])
        assert f"example: moit {verb}" in capsys.readouterr().out
