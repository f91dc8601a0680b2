"""Images on triangles are read as a plain model in float64 reads them."""

import itertools

import numpy as np
import pytest

import moit
from moit import _core

SUBPIXELS = 256
SIZE = (23, 17)
CAMERA = moit.Camera(eye=(0.2, 0.3, 3.0), fov_y=0.8, near=0.5, far=50.0)
WRAPS = ("repeat", "mirror", "clamp")
FILTERS = ("nearest", "bilinear", "mipmap")


def wrapped(index, count, wrap):
    if wrap == "repeat":
        return index % count
    if wrap == "mirror":
        around = index % (2 * count)
        return np.where(around < count, around, 2 * count - 1 - around)
    return np.clip(index, 0, count - 1)


def bilinear(image, u, v, wraps):
    height, width, _ = image.shape
    x, y = u * width - 0.5, v * height - 0.5
    left, top = np.floor(x), np.floor(y)
    total = 0
    for right, below in itertools.product((0, 1), (0, 1)):
        weight = np.abs(1 - right - (x - left)) * np.abs(1 - below - (y - top))
        column = wrapped((left + right).astype(int), width, wraps[0])
        row = wrapped((top + below).astype(int), height, wraps[1])
        total = total + weight[:, None] * image[row, column]
    return total


def smaller(image):
    """Half as many columns and rows, at least one: means by area, of colour by alpha."""

    def shares(many):
        few = max(many // 2, 1)
        ends = np.arange(few + 1) * many / few
        low, high = ends[:-1, None], ends[1:, None]
        at = np.arange(many)
        return np.clip(np.minimum(at + 1, high) - np.maximum(at, low), 0, 1) / (high - low)

    rows, columns = shares(image.shape[0]), shares(image.shape[1])

    def mean(values):
        return np.einsum("yi,xj,ijc->yxc", rows, columns, values)

    alpha = mean(image[..., 3:])
    seen = mean(image[..., :3] * image[..., 3:]) / np.where(alpha > 0, alpha, 1)
    color = np.where(alpha > 0, seen, mean(image[..., :3]))
    return np.concatenate([color, alpha], axis=2)


def levels(image):
    found = [image.astype(np.float64)]
    while max(found[-1].shape[:2]) > 1:
        found.append(smaller(found[-1]).astype(np.float32).astype(np.float64))
    return found


def read(texture, u, v, span):
    """(N, 4); span: how many texels a pixel spans, (N,)."""
    image = texture.texels.astype(np.float64)
    height, width, _ = image.shape
    if texture.filter == "nearest":
        column = wrapped(np.floor(u * width).astype(int), width, texture.wraps[0])
        row = wrapped(np.floor(v * height).astype(int), height, texture.wraps[1])
        return image[row, column]
    if texture.filter == "bilinear":
        return bilinear(image, u, v, texture.wraps)
    pyramid = levels(image)
    level = np.clip(np.log2(np.maximum(span, 1e-30)), 0, len(pyramid) - 1)
    each = np.array([bilinear(one, u, v, texture.wraps) for one in pyramid])
    low = np.floor(level).astype(int)
    high = np.minimum(low + 1, len(pyramid) - 1)
    share = (level - low)[:, None]
    at = np.arange(len(u))
    return (1 - share) * each[low, at] + share * each[high, at]


def seen(camera, size, mesh):
    """Of each pixel of a picture that one triangle covers alone: z, interpolated (u, v), colour and
    alpha, and how many texels it spans; corners are on whole 1/256 pixels, as the rasteriser's."""
    right, up, forward = camera.axes
    away = mesh.vertices.astype(np.float64) - np.array(camera.eye)
    z = away @ forward
    scale = camera.scale(size)
    x = np.rint(size[0] * (0.5 + 0.5 * scale[0] * (away @ right) / z) * SUBPIXELS) / SUBPIXELS
    y = np.rint(size[1] * (0.5 - 0.5 * scale[1] * (away @ up) / z) * SUBPIXELS) / SUBPIXELS
    height, width, _ = mesh.texture.texels.shape
    out = {}
    for triangle in mesh.triangles:
        # all that is linear on the surface, over z, is linear on the screen: solve for it
        plane = np.linalg.inv(np.column_stack([x[triangle], y[triangle], np.ones(3)]))
        values = (
            np.column_stack([mesh.uv, mesh.color, mesh.alpha, np.ones(len(z))])[triangle].astype(
                np.float64
            )
            / z[triangle, None]
        )
        planes = plane @ values
        edges = plane  # of each corner's weight
        for row, column in itertools.product(range(size[1]), range(size[0])):
            at = np.array([column + 0.5, row + 0.5, 1])
            if (at @ edges > 1e-9).all():
                over = at @ planes
                value = over / over[-1]
                change = (planes[:2] - value * planes[:2, -1:]) / over[-1]
                spans = np.hypot(change[:, 0] * width, change[:, 1] * height)
                out[row, column] = (1 / over[-1], value[:-1], spans.max())
    return out


def square(texture, uv_scale=1.0, tilt=0.0, **options):
    """A square that fills the picture and more, leaning back by tilt."""
    place = np.array([[-2, -2, 2 * tilt], [2, -2, 2 * tilt], [2, 2, -2 * tilt], [-2, 2, -2 * tilt]])
    uv = uv_scale * (np.array([[0, 1], [1, 1], [1, 0], [0, 0.0]]) - 0.37)
    return moit.Mesh(place, [[0, 1, 2], [0, 2, 3]], uv=uv, texture=texture, lit=False, **options)


def assert_read(mesh, camera=CAMERA, size=SIZE, atol=3e-6):
    # float32's rounding of what is kept, and of levels; more where coordinates are large
    f = moit.rasterize(mesh, camera, size)
    expected = seen(camera, size, mesh)
    asked = sorted(expected)
    ids = np.array([row * size[1 - 1] + column for row, column in asked])
    assert (f.counts[ids] == 1).all()
    at = f.offsets[ids]
    value = np.array([expected[one][1] for one in asked])
    span = np.array([expected[one][2] for one in asked])
    texel = read(mesh.texture, value[:, 0], value[:, 1], span)
    # a texel's edge may lie within rounding of where nearest ones are asked
    unsure = np.zeros(len(ids), bool)
    if mesh.texture.filter == "nearest":
        height, width, _ = mesh.texture.texels.shape
        place = value[:, :2] * [width, height]
        unsure = (np.abs(place - np.rint(place)) < 1e-6 * (1 + np.abs(place))).any(axis=1)
        assert unsure.mean() < 0.2
    sure = ~unsure
    np.testing.assert_allclose(
        f.color[at][sure], (value[:, 2:5] * texel[:, :3])[sure], atol=atol, rtol=1e-6
    )
    np.testing.assert_allclose(
        f.alpha[at][sure], (value[:, 5] * texel[:, 3])[sure], atol=atol, rtol=1e-6
    )
    return span, texel


def noise(width, height, seed=0):
    return np.random.default_rng(seed).random((height, width, 4)).astype(np.float32)


SHAPES = [(1, 1), (4, 4), (7, 5), (1, 9), (13, 2), (64, 32)]


@pytest.mark.parametrize("filtering", FILTERS)
@pytest.mark.parametrize("wrap", [*WRAPS, ("mirror", "clamp"), ("clamp", "repeat")])
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_images_are_read_as_the_model_reads_them(shape, wrap, filtering):
    texture = moit.Texture(noise(*shape), wrap=wrap, filter=filtering)
    for scale, tilt in ((1.0, 0.0), (0.2, 0.4), (5.3, 0.7), (-2.5, -0.9)):
        assert_read(square(texture, scale, tilt))
