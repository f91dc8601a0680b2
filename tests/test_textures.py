"""Images on triangles are read as a plain model in float64 reads them."""

import dataclasses
import itertools

import gpu
import numpy as np
import pytest

import moit
from moit import _core
from moit.geometry.coplanar import by_draw_order
from moit.geometry.meshes import mesh_arrays, seen_in

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
        return np.einsum("yi,xj,ijc->yxc", rows, columns, values, optimize=True)

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
    ids = np.array([row * size[0] + column for row, column in asked])
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


SHADES = {
    "color": [[0.1, 0.9, 0.4], [1.5, 0.2, 0.6], [0.3, 0.3, 3.0], [0.8, 0.7, 0.1]],
    "alpha": [0.9, 0.4, 0.7, 0.2],
}


@pytest.mark.parametrize("filtering", FILTERS)
@pytest.mark.parametrize("wrap", [*WRAPS, ("mirror", "clamp"), ("clamp", "repeat")])
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_images_are_read_as_the_model_reads_them(shape, wrap, filtering):
    texture = moit.Texture(noise(*shape), wrap=wrap, filter=filtering)
    for scale, tilt in ((1.0, 0.0), (0.2, 0.4), (5.3, 0.7), (-2.5, -0.9)):
        assert_read(square(texture, scale, tilt, **SHADES))


def test_what_is_small_is_read_from_smaller_images():
    texture = moit.Texture(noise(128, 128))
    spans = []
    for distance in (1.5, 4.0, 12.0, 40.0):
        camera = moit.Camera(eye=(0.1, 0.2, distance), fov_y=0.8, near=0.5, far=99.0)
        span, texel = assert_read(square(texture, 8.0, 0.5, **SHADES), camera)
        spans.append(span.mean())
    assert spans[0] < 30 < spans[-1]
    np.testing.assert_allclose(texel, texel.mean(axis=0) + np.zeros_like(texel), atol=0.1)


def test_derivatives_hold_where_corners_are_clipped():
    # a floor from behind the eye: as the same floor cut by hand in front of it
    texture = moit.Texture(noise(64, 64))
    eye = moit.Camera(eye=(0, 0, 0), target=(0, 0, -1), near=0.5, far=80.0)
    floors = []
    for nearest in (30.0, -1.0):
        place = np.array([[-40, -1, nearest], [40, -1, nearest], [40, -1, -70], [-40, -1, -70]])
        uv = place[:, [0, 2]] / 3
        floors.append(moit.Mesh(place, [[0, 1, 2], [0, 2, 3]], uv=uv, texture=texture, lit=False))
    cut, whole = (moit.rasterize(floor, eye, (64, 48)) for floor in floors[::-1])
    lower = slice(64 * 27, 64 * 40)  # rows that the cut one has too, and whose horizon is far
    assert (whole.counts[lower] == 1).all()
    assert (cut.counts[lower] == 1).all()
    one, other = (f.color[f.offsets[64 * 27] : f.offsets[64 * 40]] for f in (cut, whole))
    # both snap corners of their own to 1/256 pixel
    np.testing.assert_allclose(one, other, atol=0.02)


def test_a_texture_that_is_opaque_at_its_rim_alone_is_read_inside():
    image = np.zeros((16, 16, 4), np.uint8)
    image[2:14, 2:14] = 188, 188, 188, 255
    place = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    for filtering in FILTERS:
        texture = moit.Texture(image, color_space="srgb", filter=filtering)
        mesh = moit.Mesh(
            place,
            [[0, 1, 2], [0, 2, 3]],
            (1, 1, 1),
            uv=[[0, 1], [1, 1], [1, 0], [0, 0]],
            texture=texture,
            lit=False,
        )
        camera = moit.Camera(eye=(0, 0, 1 / np.tan(0.2)), fov_y=0.4)
        for side in (16, 64, 512):
            f = moit.rasterize(mesh, camera, (side, side))
            assert (f.counts == 1).all()
            assert f.alpha.mean() == pytest.approx(0.5625, abs=1e-6)
            inside = f.alpha == 1
            linear = ((188 / 255 + 0.055) / 1.055) ** 2.4
            np.testing.assert_allclose(f.color[inside], linear, rtol=1e-6)


def stencil(side=8):
    """A disk's alpha in a square, soft at its rim."""
    x = (np.arange(side) + 0.5) / side - 0.5
    away = np.hypot(x[:, None], x)
    image = np.ones((side, side, 4), np.float32)
    image[..., 3] = np.clip(0.5 + side * (0.35 - away) / 2, 0, 1)
    return image


def test_cutouts_are_opaque_or_not_there():
    texture = moit.Texture(stencil(), filter="bilinear", wrap="clamp")
    uv = {"uv": [[0, 1], [1, 1], [1, 0], [0, 0]]}
    place = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    faces = [[0, 1, 2], [0, 2, 3]]
    options = {**uv, "texture": texture}
    blended = moit.Mesh(place, faces, **options)
    cut = moit.Mesh(place, faces, alpha_cutoff=0.3, **options)
    behind = moit.Mesh(place - [0, 0, 1], faces, (0, 1, 0), 0.5)
    assert blended.transparent.all()
    assert not cut.transparent.any()
    camera = moit.Camera(eye=(0, 0, 3))
    size = (48, 40)
    soft = moit.rasterize(blended, camera, size)
    alpha = np.zeros(len(soft.counts))
    alpha[soft.counts == 1] = soft.alpha
    f = moit.rasterize([behind, cut], camera, size)
    alone = moit.rasterize(behind, camera, size)
    # what is cut out shows what is behind; the rest hides it
    there = alpha >= np.float32(0.3)
    assert 100 < there.sum() < (alpha > 0).sum()
    np.testing.assert_array_equal(f.counts, np.where(there, 1, alone.counts))
    assert (f.alpha[f.offsets[:-1][there]] == 1).all()
    assert f.depth_range == alone.depth_range
    everything = moit.Mesh(place, faces, alpha_cutoff=0, **options)
    nothing = moit.Mesh(place, faces, alpha_cutoff=1.5, **options)
    assert len(moit.rasterize(everything, camera, size)) == len(soft)
    assert len(moit.rasterize(nothing, camera, size)) == 0


def test_alpha_at_the_cutoff_is_there():
    texture = moit.Texture(np.full((1, 1, 4), 128, np.uint8), color_space="linear")
    for cutoff, there in ((128 / 255, True), (0.7, False), (0.2, True)):
        mesh = square(texture, alpha_cutoff=cutoff)
        assert bool(len(moit.rasterize(mesh, CAMERA, SIZE))) is there
    plain = moit.Mesh(PLACE, [[0, 1, 2]], alpha=0.7, alpha_cutoff=0.7)
    assert (moit.rasterize(plain, CAMERA, SIZE).alpha == 1).all()
    assert len(moit.rasterize(plain, CAMERA, SIZE)) > 100


def test_a_gpu_finds_alpha_at_the_cutoff_there():
    device = gpu.software_device()
    texture = moit.Texture(np.full((1, 1, 4), 128, np.uint8), color_space="linear")
    mesh = square(texture, alpha_cutoff=128 / 255)
    expected = moit.rasterize(mesh, CAMERA, SIZE)
    assert len(expected) > 300
    assert_equal(moit.rasterize(mesh, CAMERA, SIZE, device=device), expected)


PLACE = [[-2, -2, 0], [2, -2, 0], [0, 2, 0]]


def test_alpha_of_vertices_is_cut_too():
    ramp = moit.Mesh(PLACE, [[0, 1, 2]], alpha=[0, 1, 0.5], alpha_cutoff=0.5)
    whole = moit.rasterize(moit.Mesh(PLACE, [[0, 1, 2]], alpha=[0, 1, 0.5]), CAMERA, SIZE)
    f = moit.rasterize(ramp, CAMERA, SIZE)
    assert len(f) == (whole.alpha >= 0.5).sum() < len(whole)


def test_unlit_meshes_show_their_colour():
    lit, unlit = (
        moit.rasterize(moit.Mesh(PLACE, [[0, 1, 2]], (0.2, 0.5, 4), lit=lit), CAMERA, SIZE)
        for lit in (True, False)
    )
    np.testing.assert_array_equal(unlit.color, np.float32([[0.2, 0.5, 4]] * len(unlit)))
    assert not np.allclose(lit.color, unlit.color)
    dark = moit.rasterize(
        moit.Mesh(PLACE, [[0, 1, 2]], (0.2, 0.5, 4), lit=False),
        CAMERA,
        SIZE,
        lights=[((1, 0, 0), (0, 0, 0))],
    )
    np.testing.assert_array_equal(dark.color, unlit.color)


def test_a_white_texture_changes_no_bit():
    rng = np.random.default_rng(1)
    place, shades, alpha = rng.uniform(-2, 2, (60, 3)), rng.random((60, 3)), rng.random(60)
    alpha[:30] = 1
    faces = np.arange(60).reshape(-1, 3)
    plain = moit.Mesh(place, faces, shades, alpha)
    white = moit.Texture(np.ones((3, 5, 3), np.float32))
    worn = moit.Mesh(place, faces, shades, alpha, uv=rng.normal(size=(60, 2)), texture=white)
    assert_equal(moit.rasterize(worn, CAMERA, SIZE), moit.rasterize(plain, CAMERA, SIZE))
    assert_equal(
        moit.rasterize([plain, worn], CAMERA, SIZE), moit.rasterize([plain, plain], CAMERA, SIZE)
    )


def assert_equal(found, expected):
    assert found.depth_range == expected.depth_range
    for name in ("offsets", "depth", "alpha", "color"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)


@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("filtering", FILTERS)
def test_coordinates_far_outside_stay_within_the_image(wrap, filtering):
    texture = moit.Texture(noise(5, 3), wrap=wrap, filter=filtering)
    for far in (3e3, -7e8, 1e13, -3e38):
        uv = [[0, far], [far, 0], [-far, far / 3]]
        mesh = moit.Mesh(PLACE, [[0, 1, 2]], (1, 1, 1), uv=uv, texture=texture, lit=False)
        f = moit.rasterize(mesh, CAMERA, SIZE)
        assert len(f) > 50
        assert np.isfinite(f.color).all()
        assert f.color.min() >= texture.texels[..., :3].min() - 1e-6
        assert f.color.max() <= texture.texels[..., :3].max() + 1e-6


def test_whole_periods_of_an_image_are_the_image():
    texture = moit.Texture(noise(8, 8), filter="nearest")
    one, other = (
        moit.rasterize(
            moit.Mesh(
                PLACE, [[0, 1, 2]], uv=np.array([[0, 0], [1, 0], [0, 1]]) + by, texture=texture
            ),
            CAMERA,
            SIZE,
        )
        for by in (0, [1024, -2048])
    )
    assert np.mean(one.color == other.color) > 0.97  # at edges of texels floats of uv decide


def test_threads_change_no_bit():
    mesh = square(moit.Texture(noise(33, 17)), 6.0, 0.8, **SHADES)
    one, other = (moit.rasterize(mesh, CAMERA, (150, 130), threads=n) for n in (1, 5))
    assert_equal(one, other)


def test_smaller_images_are_means_and_what_is_transparent_does_not_bleed():
    image = noise(6, 10)
    image[::2, :, 3] = 0
    image[::2, :, :3] = 9
    texture = moit.Texture(image)
    levels_of_model = np.concatenate([one.reshape(-1, 4) for one in levels(image)])
    np.testing.assert_allclose(texture.levels, levels_of_model, rtol=1e-5, atol=1e-6)
    first = texture.levels[60:75]
    assert (first[:, :3] < 1).all()
    assert texture.levels[-1, 3] == pytest.approx(image[..., 3].mean(), rel=1e-5)
    blank = moit.Texture(np.zeros((4, 4, 4), np.float32) + np.float32([0.5, 0.25, 1, 0]))
    np.testing.assert_array_equal(blank.levels[:, :3], [[0.5, 0.25, 1]] * 21)


def test_integers_and_srgb_are_decoded_once():
    levels8 = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(4, axis=2)
    linear = moit.Texture(levels8, color_space="linear").texels
    decoded = moit.Texture(levels8, color_space="srgb").texels
    share = levels8 / 255
    np.testing.assert_allclose(linear, share, rtol=1e-6)
    np.testing.assert_allclose(decoded[..., 3], share[..., 3], rtol=1e-6)
    np.testing.assert_allclose(
        decoded[..., 0],
        np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)[..., 0],
        rtol=1e-6,
    )
    floats = moit.Texture(share, color_space="srgb").texels
    np.testing.assert_allclose(floats, decoded, rtol=1e-5, atol=1e-9)
    wide = moit.Texture((levels8.astype(np.uint16) * 257), color_space="srgb").texels
    np.testing.assert_allclose(wide, decoded, rtol=1e-6)
    assert moit.Texture(levels8[..., :3], color_space="linear").texels[..., 3].min() == 1


def test_a_texture_keeps_a_copy_and_does_not_change():
    image = noise(2, 2)
    texture = moit.Texture(image, filter="nearest")
    image[:] = 0
    assert texture.texels.min() > 0
    with pytest.raises(ValueError, match="read-only"):
        texture.texels[0] = 1
    with pytest.raises(AttributeError):
        texture.filter = "bilinear"
    other = dataclasses.replace(texture, wrap="clamp")
    np.testing.assert_array_equal(other.texels, texture.texels)


@pytest.mark.parametrize(
    ("image", "options", "error", "words"),
    [
        (np.zeros((2, 2)), {}, ValueError, r"image: expected shape \(H, W, 3\)"),
        (np.zeros((2, 2, 2)), {}, ValueError, r"image: expected shape \(H, W, 3\)"),
        (np.zeros((0, 2, 3)), {}, ValueError, r"image: expected shape \(H, W, 3\)"),
        (np.zeros((1, 16385, 3), "f2"), {}, ValueError, "sides of at most 16384 texels"),
        (np.zeros((2, 2, 3), np.uint8), {}, ValueError, "image: uint8 does not say.*color_space"),
        (np.zeros((2, 2, 3), int), {}, TypeError, "image: expected floats, uint8 or uint16"),
        (np.full((2, 2, 3), -1.0), {}, ValueError, r"image\[0, 0, 0\]: found -1.0; needed a num"),
        (np.full((2, 2, 4), 1.5), {}, ValueError, r"image\[0, 0, 3\]: found 1.5; needed alpha"),
        (np.full((2, 2, 3), np.nan), {}, ValueError, r"image\[0, 0, 0\]: found nan"),
        (np.ones((2, 2, 3)), {"wrap": "mirrored"}, ValueError, "wrap: expected 'repeat', 'mirror'"),
        (np.ones((2, 2, 3)), {"wrap": ("clamp",)}, ValueError, "wrap: expected one name, or a t"),
        (np.ones((2, 2, 3)), {"wrap": 3}, ValueError, "wrap: expected"),
        (np.ones((2, 2, 3)), {"filter": "linear"}, ValueError, "filter: expected 'nearest', 'bil"),
        (np.ones((2, 2, 3)), {"color_space": "sRGB"}, ValueError, "color_space: expected 'linear'"),
    ],
)
def test_bad_images_say_what_was_needed(image, options, error, words):
    with pytest.raises(error, match=words):
        moit.Texture(image, **options)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"uv": [[0, 0]]}, moit.MeshError, r"uv: expected shape \(3, 2\), got \(1, 2\)"),
        ({"uv": [[0, 0], [0, np.inf], [0, 0]]}, moit.MeshError, r"uv\[1, 1\]: found inf"),
        ({"texture": moit.Texture(np.ones((1, 1, 3)))}, moit.MeshError, "texture: needed uv"),
        ({"texture": np.ones((1, 1, 3))}, TypeError, "texture: expected a Texture or None"),
        ({"alpha_cutoff": -0.5}, moit.MeshError, "alpha_cutoff: expected a number that is not neg"),
        ({"alpha_cutoff": [0.5, 0.5]}, moit.MeshError, "alpha_cutoff: expected a number"),
        ({"alpha_cutoff": np.nan}, moit.MeshError, "alpha_cutoff: found nan"),
        ({"lit": "no"}, TypeError, "lit: expected True or False"),
    ],
)
def test_bad_clothes_say_what_was_needed(options, error, words):
    with pytest.raises(error, match=words):
        moit.Mesh(PLACE, [[0, 1, 2]], **options)


def dressed_scene(seed=3):
    """Walls, glass and cut-outs with and without textures, some across the eye's plane."""
    rng = np.random.default_rng(seed)
    images = [
        moit.Texture(noise(13, 7), wrap=("mirror", "repeat")),
        moit.Texture(stencil(), filter="bilinear", wrap="clamp"),
        moit.Texture(noise(4, 4)[..., :3], filter="nearest"),
        None,
    ]
    found = []
    for i in range(16):
        place = rng.normal(size=(15, 3)) + rng.normal(size=3)
        found.append(
            moit.Mesh(
                place,
                np.arange(15).reshape(-1, 3),
                rng.random((15, 3)),
                rng.choice([1.0, 1.0, 0.4]),
                rng.normal(size=(15, 3)) if i % 3 else None,
                uv=rng.normal(size=(15, 2)) * 3,
                texture=images[i % 4],
                alpha_cutoff=0.5 if i % 5 == 0 else None,
                lit=i % 7 != 0,
            )
        )
    return found


@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("filtering", FILTERS)
def test_a_gpu_reads_the_same_bits(wrap, filtering):
    device = gpu.software_device()
    for shape in SHAPES:
        texture = moit.Texture(noise(*shape), wrap=wrap, filter=filtering)
        for options in ({}, {"alpha_cutoff": 0.5}, SHADES):
            mesh = square(texture, 3.3, 0.6, **options)
            expected = moit.rasterize(mesh, CAMERA, SIZE)
            assert_equal(moit.rasterize(mesh, CAMERA, SIZE, device=device), expected)
        uv = [[0, 1e30], [-3e38, 0], [7e8, -7e8]]
        mesh = moit.Mesh(PLACE, [[0, 1, 2]], uv=uv, texture=texture)
        expected = moit.rasterize(mesh, CAMERA, SIZE)
        assert_equal(moit.rasterize(mesh, CAMERA, SIZE, device=device), expected)


def test_a_gpu_draws_what_wears_different_things_in_order():
    device = gpu.software_device()
    scene = dressed_scene()
    lights = [((1, -2, 0.5), (1, 0.5, 0)), ((0, 0, -3), (0.1, 0.4, 2.0))]
    for eye in ((0.1, 0.2, 0.3), (0, 0, 6)):
        camera = moit.Camera(eye=eye, fov_y=1.0, near=0.02, far=30)
        for options in ({}, {"lights": lights}, {"coplanar": 0.01}):
            expected = moit.rasterize(scene, camera, (70, 45), **options)
            found = moit.rasterize(scene, camera, (70, 45), device=device, **options)
            assert_equal(found, expected)
            assert len(expected) > 1500


@pytest.mark.parametrize("technique", ["sorted", "wboit", "power4", "mlab4"])
@pytest.mark.parametrize("options", [{}, {"order": "triangle"}, {"order": "object"}], ids=str)
def test_pictures_are_those_of_the_fragments(technique, options):
    scene, camera = dressed_scene(), moit.Camera(eye=(0, 0, 6))
    back = {"background": (0.2, 0.3, 0.4), "camera": camera}
    expected = moit.composite(
        moit.rasterize(scene, camera, (60, 40)), technique, background=back["background"]
    )
    found = moit.render(scene, technique, (60, 40), **back, **options)
    if options and technique == "mlab4":  # which sees another order
        assert np.abs(found - expected).mean() < 0.02
    else:
        np.testing.assert_allclose(found, expected, atol=1e-5)
    drawn = moit.render(
        scene,
        technique,
        (60, 40),
        **back,
        **options,
        device=gpu.device(),
        exact=True,
        target="rgba32f",
    )
    # power4's default bias on a GPU's targets is another
    np.testing.assert_allclose(drawn, found, atol=0.03 if technique == "power4" else 1e-4)


def test_small_pictures_keep_what_meshes_wear():
    scene, camera = dressed_scene(), moit.Camera(eye=(0, 0, 6))
    whole = moit.render(scene, "wboit", (64, 48), camera=camera)
    small = moit.render(scene, "wboit", (64, 48), camera=camera, resolution=2)
    assert 1e-4 < np.abs(whole - small).mean() < 0.05
    drawn = moit.render(
        scene,
        "wboit",
        (64, 48),
        camera=camera,
        resolution=2,
        device=gpu.device(),
        target="rgba32f",
    )
    np.testing.assert_allclose(drawn, small, atol=1e-3)


@pytest.mark.parametrize("technique", ["sorted", "power6"])
@pytest.mark.parametrize("far", [True, False], ids=["from afar", "from a point"])
def test_shadows_of_cutouts_have_their_holes(technique, far):
    texture = moit.Texture(stencil(32), wrap="clamp", filter="bilinear")
    place = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]])
    uv = [[0, 0], [1, 0], [1, 1], [0, 1]]
    light = (0, -1, 0) if far else moit.Camera(eye=(0, 5, 0), up=(0, 0, 1), near=1, far=20)
    under = np.array([[0, -1, 0], [0.95, -1, 0.95], [0.4, -1, 0.1]])
    options = {"light": light, "resolution": 64, "filter": 1}
    for alpha_cutoff, alpha, expected in ((0.5, 1, [0, 1, 0]), (None, 0.5, [0.5, 1, 0.5])):
        mesh = moit.Mesh(
            place,
            [[0, 1, 2], [0, 2, 3]],
            alpha=alpha,
            uv=uv,
            texture=texture,
            alpha_cutoff=alpha_cutoff,
        )
        got = moit.ShadowMap(mesh, technique, **options).transmittance(under)
        np.testing.assert_allclose(got, expected, atol=0.02)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("width", 6),  # more than there are texels
        ("height", 0),
        ("width", 2.5),
        ("filtering", 3),
        ("filtering", 2),  # whose levels there are not
        ("wrap_u", -1),
        ("first", np.nan),
    ],
)
def test_the_core_reads_no_texel_that_is_not_there(name, value):
    mesh = square(moit.Texture(noise(5, 3), filter="bilinear"))
    seen = seen_in(CAMERA.frame(SIZE, 1), np.zeros(3))
    assert len(_core.rasterize(mesh_arrays([mesh], np.zeros(3)), seen, *SIZE, 1)[1]) > 300
    with pytest.raises(ValueError, match=r"materials of this mesh do not fit|all levels of an im"):
        _core.rasterize(mesh_arrays([mesh], np.zeros(3), **{name: value}), seen, *SIZE, 1)
    *arrays, which, rows, texels = mesh_arrays([mesh], np.zeros(3))
    for wrong in ((which + 1, rows, texels), (which[:1], rows, texels), (which, rows, ())):
        with pytest.raises(ValueError, match="materials of this mesh do not fit"):
            _core.rasterize((*arrays, *wrong), seen, *SIZE, 1)


def test_more_texels_than_a_device_holds_are_an_error(monkeypatch):
    monkeypatch.setattr("moit.gpu.meshes.MOST_SIDE", 4)
    mesh = square(moit.Texture(noise(5, 4)))
    with pytest.raises(
        moit.GpuError, match=r"scene: its textures have 25 texels.*holds 16; use sm"
    ):
        moit.rasterize(mesh, CAMERA, SIZE, device=gpu.device())


def tilted(place, angle=0.9):
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    return np.asarray(place, float) @ turn.T


def sheet(scale, offset, color, alpha=1.0):
    """A tilted square; all of them lie in one plane but for rounding."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    place = tilted(corners * [*scale, 1] + [*offset, 0])
    return moit.Mesh(place, [[0, 1, 2], [0, 2, 3]], color, alpha, lit=False)


DECAL = sheet((0.61, 0.53), (0.113, 0.071), (1, 0, 0))
WALL = sheet((2.03, 1.7), (0, 0), (0, 0, 1))
GLASS = sheet((0.71, 0.73), (0.05, 0), (0, 1, 0), 0.5)
TINT = sheet((0.9, 0.4), (-0.05, 0.1), (1, 1, 0), 0.25)
LOOK = moit.Camera(eye=(0.1, 0.2, 3))


def area(scene, of, **options):
    """Of a scene's picture, where there is a mesh alone, the parts that some colour fills."""
    alone = moit.rasterize(of, LOOK, (64, 48)).counts > 0
    image = moit.composite(moit.rasterize(scene, LOOK, (64, 48), **options), "sorted")
    return image.reshape(-1, 4)[alone]


def test_without_a_tolerance_rounding_chooses_among_surfaces_in_one_plane():
    shares = [(area(scene, DECAL)[:, 0] > 0.5).mean() for scene in ([DECAL, WALL], [WALL, DECAL])]
    assert 0.05 < shares[1] <= shares[0] < 0.95  # where they are equal the first is in front


@pytest.mark.parametrize("on_gpu", [False, True])
def test_of_opaque_surfaces_in_one_plane_the_first_is_in_front(on_gpu):
    where = {"device": gpu.device()} if on_gpu else {}
    options = {"coplanar": 1e-3, **where}
    assert (area([DECAL, WALL], DECAL, **options)[:, 0] == 1).all()
    assert (area([WALL, DECAL], DECAL, **options)[:, 2] == 1).all()


@pytest.mark.parametrize("on_gpu", [False, True])
def test_what_is_transparent_is_seen_before_what_it_lies_on(on_gpu):
    where = {"device": gpu.device()} if on_gpu else {}
    for scene in ([GLASS, WALL], [WALL, GLASS]):
        found = area(scene, GLASS, coplanar=1e-3, **where)
        np.testing.assert_allclose(found[:, 1:3], 0.5, atol=1e-6)
    first = area([GLASS, TINT], TINT, coplanar=1e-3, **where)
    second = area([TINT, GLASS], TINT, coplanar=1e-3, **where)
    both = (first[:, 1] != first[:, 0]) & (first[:, 0] > 0)
    np.testing.assert_allclose(
        first[both].mean(axis=0)[:2], [0.5 * 0.25, 0.5 + 0.5 * 0.25], atol=1e-6
    )
    np.testing.assert_allclose(second[both].mean(axis=0)[:2], [0.25, 0.25 + 0.75 * 0.5], atol=1e-6)


def test_depths_within_the_tolerance_become_one_and_others_stay():
    offsets = np.array([0, 6, 6, 10])
    depth = np.float32([5, 2, 2.05, 2.2, 2.11, 9, 4.04, 4, 4.12, 3.95])
    alpha = np.float32([0.5, 0.5, 0.2, 0.3, 0.4, 1, 0.5, 1, 1, 1])
    color = np.arange(30, dtype=np.float32).reshape(10, 3)
    ends, at, opacity, shade = by_draw_order((offsets, depth, alpha, color), 0.1)
    # a pixel without a wall near it: from the nearest on; the wall first
    assert ends.tolist() == [0, 6, 6, 8]
    np.testing.assert_array_equal(at[:6], np.float32([9, 5, 2, 2, 2.11, 2.11]))
    assert opacity[:6].tolist() == alpha[[5, 0, 1, 2, 3, 4]].tolist()
    # of opaque ones within .1 of the nearest the first, at its depth; 4.04 is as near
    np.testing.assert_array_equal(at[6:], np.float32([3.95, 3.95]))
    np.testing.assert_array_equal(shade[6:], color[[7, 6]])


def test_no_tolerance_and_one_of_zero_are_one_picture():
    scene = dressed_scene()
    plain = moit.rasterize(scene, LOOK, (60, 50))
    zero = moit.rasterize(scene, LOOK, (60, 50), coplanar=0)
    np.testing.assert_array_equal(moit.composite(zero, "sorted"), moit.composite(plain, "sorted"))
    assert zero.depth_range == plain.depth_range


@pytest.mark.parametrize(
    ("coplanar", "error", "words"),
    [
        (-1e-3, ValueError, "coplanar: found -0.001; needed a number that is not negative"),
        (np.inf, ValueError, "coplanar: found inf"),
        ("near", TypeError, "coplanar: expected a number or None"),
    ],
)
def test_bad_tolerances_say_what_was_needed(coplanar, error, words):
    with pytest.raises(error, match=words):
        moit.rasterize(WALL, LOOK, (4, 4), coplanar=coplanar)
