"""Pictures some of whose meshes are drawn small, on the CPU and by passes."""

import dataclasses
import itertools
import math

import gpu
import numpy as np
import pytest
from readings import c, glsl

import moit
from moit import _core

SIZE = (46, 29)  # neither is a multiple of 2, 4 or 8 on both sides
CAMERA = moit.Camera(eye=(0.2, 0.1, 3.0), near=0.5, far=20.0)
AHEAD = moit.Camera(eye=(0.0, 0.0, 3.0), near=0.5, far=20.0)
BEHIND = (0.2, 0.3, 0.4)
ADDING = list(dict.fromkeys(one.kind for one in moit.techniques() if one.adds_targets))


def pane(z, color=(0.8, 0.4, 0.1), alpha=0.5, left=-9.0, right=9.0, top=9.0, bottom=-9.0):
    """Faces AHEAD."""
    corners = [[left, bottom, z], [right, bottom, z], [right, top, z], [left, top, z]]
    return moit.Mesh(corners, [[0, 1, 2], [0, 2, 3]], color, alpha)


def slanted(count=14, seed=0, alpha=(0.1, 0.7)) -> list[moit.Mesh]:
    rng = np.random.default_rng(seed)
    return [
        moit.Mesh(
            rng.uniform(-1.6, 1.6, (3, 3)) * [1.5, 1.2, 0.6],
            [[0, 1, 2]],
            rng.random(3),
            rng.uniform(*alpha),
        )
        for _ in range(count)
    ]


OCCLUDER = moit.Mesh([[-3, -2, -1], [3, -2, -1], [0, 3, -1.2]], [[0, 1, 2]], (0.5, 0.6, 0.7))
# alpha is 1 along an edge, and in the corner where two are
CUTOUT = moit.Mesh(
    [[-1.2, -0.9, 0.3], [1.2, -0.9, 0.3], [0, 1, 0.3], [0, 0, 0.3]],
    [[0, 1, 3], [1, 2, 3], [2, 0, 3]],
    (0.1, 0.7, 0.2),
    (1.0, 1.0, 0.3, 1.0),
)
SCENE = [*slanted(), OCCLUDER, CUTOUT]
MIXED = [4, 1, 2, 1, 8, 1, 1, 2, 4, 1, 2, 1, 1, 8, 2, 4]


def picture(scene=SCENE, technique="wboit", size=SIZE, camera=CAMERA, **options):
    return moit.render(scene, technique, size, camera=camera, background=BEHIND, **options)


@pytest.mark.parametrize("technique", ["wboit", "weighted-average", "power6", "sorted", "mlab2"])
@pytest.mark.parametrize("one", [1, [1] * len(SCENE), {}, {3: 1}, np.ones(16, int)])
def test_nothing_small_is_the_ordinary_picture(technique, one):
    np.testing.assert_array_equal(
        picture(technique=technique, resolution=one), picture(technique=technique)
    )


@pytest.mark.parametrize("technique", ADDING)
@pytest.mark.parametrize("upsampling", ["bilinear", "depth-aware"])
@pytest.mark.parametrize("side", [2, 4, 8])
@pytest.mark.parametrize("device", ["cpu", "gpu"])
def test_planes_that_face_the_camera_are_exact_whatever_their_order(
    technique, upsampling, side, device
):
    """Small ones before, between and behind others."""
    if device == "gpu":
        device = gpu.device()
    planes = [pane(z, np.array([z, 1, 1 - z]) ** 2, 0.2 + 0.3 * z) for z in (0, 0.4, 0.7, 1)]
    found = picture(
        planes,
        technique,
        camera=AHEAD,
        resolution=[side, 1, side, 1],
        upsampling=upsampling,
        device=device,
        **({} if device == "cpu" else {"target": "rgba32f"}),
    )
    # a plane's 1 / z is interpolated, to some 1e-7
    np.testing.assert_allclose(found, picture(planes, technique, camera=AHEAD), atol=2e-6)


@pytest.mark.parametrize("side", [2, 4, 8])
def test_a_plane_differs_near_its_edge_alone(side):
    plane = pane(0, left=-0.8, right=0.7, top=0.9, bottom=-0.5)
    apart = np.abs(picture(plane, camera=AHEAD, resolution=side) - picture(plane, camera=AHEAD))
    covered = picture(plane, camera=AHEAD)[..., 3] > 0
    off = apart.max(axis=2) > 1e-6
    assert off.any()
    edge = np.zeros_like(covered)
    for axis in (0, 1):
        edge |= np.diff(covered, axis=axis, append=np.take(covered, [-1], axis)) != 0
    rows, columns = np.nonzero(edge)
    for y, x in np.argwhere(off):
        assert np.maximum(np.abs(rows - y), np.abs(columns - x)).min() <= 1.5 * side


@pytest.mark.parametrize("side", [2, 4, 8])
def test_interpolation_keeps_the_sum_of_light(side):
    """What is small and away from the border adds up to what a small picture has."""
    scene, size = slanted(8, alpha=(0.02, 0.05)), (64, 48)
    scene = [scaled(mesh, 0.6) for mesh in scene]
    small = (size[0] // side, size[1] // side)
    found = moit.render(scene, "weighted-sum", size, camera=CAMERA, resolution=side)
    expected = moit.render(scene, "weighted-sum", small, camera=CAMERA)
    assert expected[..., :3].sum() > 0.1
    np.testing.assert_allclose(
        found.sum(axis=(0, 1)), side**2 * expected.sum(axis=(0, 1)), rtol=1e-5
    )


def scaled(mesh: moit.Mesh, scale: float) -> moit.Mesh:
    return moit.Mesh(scale * mesh.vertices, mesh.triangles, mesh.color, mesh.alpha)


# ---- An implementation from the post, in plain loops --------------------------------------------


def weight(technique: str, color, alpha, depth) -> float:
    if technique != "wboit":
        return 1.0
    f = moit.Fragments([0, 1, 2], [depth, 4.0], [alpha, 0.5], [color, (1.0, 1, 1)])
    # what two in one pixel count tells the ratio of their weights
    both = moit.Fragments([0, 2], f.depth, f.alpha, f.color, depth_range=f.depth_range)
    T = moit.transmittance(both, "wboit", dtype=np.float64)
    return float(T[0] / T[1])


def sums_of(f: moit.Fragments, technique: str, walls) -> np.ndarray:
    """(height, width, 5) of what no wall hides, and what is no wall itself."""
    height, width = f.shape
    sums = np.zeros((height * width, 5))
    sums[:, 4] = technique == "wboit"
    for p in range(height * width):
        for i in range(f.offsets[p], f.offsets[p + 1]):
            alpha, depth = float(f.alpha[i]), float(f.depth[i])
            if alpha == 1 or depth > walls.reshape(-1)[p]:
                continue
            w = alpha * weight(technique, f.color[i], alpha, depth)
            sums[p, :3] += w * f.color[i]
            sums[p, 3] += w
            if technique == "wboit":
                sums[p, 4] *= 1 - alpha
            else:
                sums[p, 4] += 1
    return sums.reshape(height, width, 5)


def walls_of(f: moit.Fragments):
    height, width = f.shape
    depth, color = np.full(height * width, np.inf), np.full((height * width, 3), BEHIND)
    for p in range(height * width):
        for i in range(f.offsets[p], f.offsets[p + 1]):
            if f.alpha[i] == 1 and f.depth[i] < depth[p]:
                depth[p], color[p] = f.depth[i], f.color[i]
    return depth.reshape(height, width), color.reshape(height, width, 3)


def like(a: float, b: float) -> float:
    if a == b:
        return 1.0 + 1 / 256
    if math.isinf(a) or math.isinf(b):  # held as 1, the others as parts of 64
        a, b = (1.0 if math.isinf(x) else x / 64 for x in (a, b))
    return 1 / (1 + (64 * abs(a - b) / max(a, b)) ** 2) + 1 / 256


def read_small(sums, small_walls, walls, side: int, aware: bool) -> np.ndarray:
    (height, width), (h, w) = walls.shape, sums.shape[:2]
    found = np.zeros((height, width, 5))
    for y, x in itertools.product(range(height), range(width)):
        place = [
            (at + 0.5 - whole / 2) / side + small / 2 - 0.5
            for at, whole, small in ((y, height, h), (x, width, w))
        ]
        total = 0.0
        for j, i in itertools.product(*({math.floor(at), math.floor(at) + 1} for at in place)):
            share = (1 - abs(j - place[0])) * (1 - abs(i - place[1]))
            at = (min(max(j, 0), h - 1), min(max(i, 0), w - 1))
            share *= like(walls[y, x], small_walls[at]) if aware else 1
            total += share
            found[y, x] += share * sums[at]
        found[y, x] /= total
    return found


def by_the_post(scene, factors, technique, size, upsampling) -> np.ndarray:
    everything = moit.rasterize(scene, CAMERA, size)
    walls, color = walls_of(everything)
    height, width = walls.shape
    of_one = [mesh for mesh, factor in zip(scene, factors, strict=True) if factor == 1]
    sums = sums_of(moit.rasterize(of_one, CAMERA, size), technique, walls)
    for side in sorted({factor for factor in factors if factor > 1}):
        some = [mesh for mesh, factor in zip(scene, factors, strict=True) if factor == side]
        some = [mesh for mesh in some if mesh.transparent.any()]
        if not some:
            continue
        w, h = -(-width // side), -(-height // side)
        wider = 2 * math.atan(math.tan(CAMERA.fov_y / 2) * h * side / height)
        camera = dataclasses.replace(CAMERA, fov_y=wider)
        hiding = np.full((h, w), np.nan)
        for y, x in itertools.product(range(height), range(width)):
            j = math.floor((y + 0.5 - height / 2) / side + h / 2)
            i = math.floor((x + 0.5 - width / 2) / side + w / 2)
            turn = upsampling == "depth-aware" and (i + j) % 2 == 1
            best = min if turn else max
            old = hiding[j, i]
            hiding[j, i] = walls[y, x] if np.isnan(old) else best(old, walls[y, x])
        small = sums_of(moit.rasterize(some, camera, (w, h)), technique, hiding)
        read = read_small(small, hiding, walls, side, upsampling == "depth-aware")
        sums[..., :4] += read[..., :4]
        sums[..., 4] = (
            sums[..., 4] * read[..., 4] if technique == "wboit" else sums[..., 4] + read[..., 4]
        )
    total = sums[..., 4]
    if technique == "weighted-sum":
        total = 1 - sums[..., 3]
    if technique == "weighted-average":
        n = sums[..., 4]
        mean = np.divide(sums[..., 3], n, out=np.zeros_like(n), where=n > 0)
        total = (1 - mean) ** n
    share = np.divide(1 - total, sums[..., 3], out=np.ones_like(total), where=sums[..., 3] > 0)
    image = np.empty((height, width, 4))
    image[..., :3] = total[..., None] * color + share[..., None] * sums[..., :3]
    image[..., 3] = np.where(np.isinf(walls), 1 - total, 1)
    return image


@pytest.mark.parametrize("technique", ADDING)
@pytest.mark.parametrize("upsampling", ["bilinear", "depth-aware"])
def test_the_picture_is_that_of_plain_loops(technique, upsampling):
    scene, factors = [*SCENE[:6], OCCLUDER, CUTOUT], [4, 1, 2, 4, 1, 2, 8, 2]
    size = (22, 13)
    found = picture(scene, technique, size, resolution=factors, upsampling=upsampling)
    expected = by_the_post(scene, factors, technique, size, upsampling)
    # the shares of squares are floats
    np.testing.assert_allclose(found, expected, atol=3e-6)


# ---- On a device --------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_shares_of_squares_are_the_same_bits_in_both_languages(dtype):
    rng = np.random.default_rng(5)
    asked = rng.random((5000, 7)) ** [1, 1, 4, 4, 4, 4, 4] * [1, 1, 0.5, 0.5, 0.5, 0.5, 0.5]
    asked[:, 2:][rng.random((5000, 5)) < 0.2] = 1  # no surface
    asked[::7, 3:] = asked[::7, 2:3]
    asked = asked.astype(dtype)
    found = c.upsampling_shares(asked)
    np.testing.assert_array_equal(glsl.upsampling_shares(asked), found)
    assert (found >= 0).all()
    sums = found.reshape(-1, 2, 4).sum(axis=2)
    np.testing.assert_allclose(sums, 1, atol=8 * np.finfo(dtype).eps)
    # where all surfaces are alike, depth changes nothing
    np.testing.assert_allclose(found[::7, 4:], found[::7, :4], atol=8 * np.finfo(dtype).eps)


@pytest.mark.parametrize("technique", [*ADDING, "wboit-eq10"])
@pytest.mark.parametrize("upsampling", ["bilinear", "depth-aware"])
@pytest.mark.parametrize("factors", [2, 8, MIXED], ids=str)
@pytest.mark.parametrize("size", [SIZE, (5, 3), (64, 32)], ids=str)
def test_passes_make_the_picture_of_the_cpu(technique, upsampling, factors, size):
    options = {"resolution": factors, "upsampling": upsampling}
    found = picture(
        SCENE,
        technique,
        size,
        device=gpu.device(),
        exact=True,
        target="rgba32f",
        report=True,
        **options,
    )
    assert found.way == "add"
    np.testing.assert_allclose(found.image, picture(SCENE, technique, size, **options), atol=5e-6)


def test_half_float_targets_are_near():
    found = picture(device=gpu.device(), exact=True, resolution=MIXED)
    np.testing.assert_allclose(found, picture(resolution=MIXED), atol=5e-3)  # 11 bits
    published = moit.WeightedBlended(bits=16)
    found = picture(technique=published, device=gpu.device(), exact=True, resolution=MIXED)
    # a byte's step each time a surface comes
    np.testing.assert_allclose(found, picture(technique=published, resolution=MIXED), atol=2e-2)


def test_what_lists_of_fragments_draw_is_joined_by_the_core():
    options = {"resolution": MIXED, "upsampling": "depth-aware"}
    with pytest.warns(RuntimeWarning, match="composited on the CPU.*: targets are joined"):
        report = picture(device=gpu.device(), exact=True, ordered="replay", report=True, **options)
    assert report.way == "replay"
    np.testing.assert_allclose(report.image, picture(**options), atol=1e-6)
    weighs = moit.WeightedBlended(lambda depth, alpha, color: 1 / depth)
    with pytest.warns(RuntimeWarning, match="composited on the CPU.*: weights are those"):
        found = picture(technique=weighs, device=gpu.device(), exact=True, **options)
    np.testing.assert_allclose(found, picture(technique=weighs, **options), atol=1e-6)


def test_small_targets_take_less_memory():
    options = {"device": gpu.device(), "report": True, "size": (64, 32)}
    sizes = [picture(resolution=side, **options).memory["small colour"] for side in (2, 4, 8)]
    assert sizes == [64 * 32 * 12 // side**2 for side in (2, 4, 8)]  # RGBA16F and R32F


# ---- What is opaque -----------------------------------------------------------------------------


@pytest.mark.parametrize("device", ["cpu", "gpu"])
@pytest.mark.parametrize("side", [2, 4, 8])
def test_walls_hide_what_is_behind_and_nothing_else(side, device):
    if device == "gpu":
        device = gpu.device()
    wall = pane(0.5, (0.1, 0.2, 0.3), 1.0)
    before, behind = pane(1.0), pane(0.0)
    options = {"camera": AHEAD, "device": device, "size": (33, 17)}
    bare = picture([wall], **options)
    np.testing.assert_array_equal(picture([wall, behind], resolution=[1, side], **options), bare)
    found = picture([before, wall, behind], resolution=[side, 1, side], **options)
    np.testing.assert_allclose(found, picture([before, wall], **options), atol=2e-3)
    assert np.abs(found - bare)[..., :3].min() > 0.05


@pytest.mark.parametrize("device", ["cpu", "gpu"])
@pytest.mark.parametrize("side", [2, 4, 8])
def test_depth_aware_reading_keeps_what_is_behind_off_walls(side, device):
    if device == "gpu":
        device = gpu.device()
    wall, behind = pane(1.0, (0.1, 0.1, 0.1), 1.0, right=0.03, bottom=-0.21), pane(0.0, alpha=0.8)
    options = {"camera": AHEAD, "size": (64, 48), "device": device}
    leaks, lacks = [], []
    full = picture([wall, behind], **options)
    hidden = picture([wall], **options)[..., 3] == 1
    for upsampling in ("bilinear", "depth-aware"):
        found = picture([wall, behind], resolution=[1, side], upsampling=upsampling, **options)
        apart = np.abs(found - full).max(axis=2)
        leaks.append(apart[hidden].max())
        lacks.append(apart[~hidden].max())
    assert leaks[0] > 0.3
    # a square with another surface weighs 1/256, and the next with the same shares down to 1/256
    assert leaks[1] < leaks[0] / 10
    assert lacks[1] < lacks[0] / 3


def test_cutouts_are_drawn_in_full():
    alone = picture([CUTOUT])
    solid = alone[..., 3] == 1
    assert 100 < solid.sum() < (alone[..., 3] > 0).sum()
    found = picture([CUTOUT], resolution=8)
    np.testing.assert_array_equal(found[..., 3] == 1, solid)


def test_foliage_small_has_its_opaque_middles_in_full():
    full = moit.rasterize(
        moit.scenes.meshes("foliage").meshes, moit.scenes.meshes("foliage").camera, (64, 36)
    )
    image = moit.render("foliage", "wboit", (64, 36), resolution=8)
    owner = np.repeat(np.arange(64 * 36), np.diff(full.offsets))
    opaque = np.zeros(64 * 36, bool)
    opaque[owner[full.alpha == 1]] = True
    np.testing.assert_array_equal(image[..., 3].ravel() == 1, opaque)


def test_what_is_opaque_is_always_full():
    np.testing.assert_array_equal(picture(resolution={14: 8}), picture())


# ---- What holds everywhere ----------------------------------------------------------------------


@pytest.mark.parametrize("technique", ADDING)
def test_the_order_of_meshes_does_not_matter(technique):
    first = picture(technique=technique, resolution=MIXED)
    turned = picture(SCENE[::-1], technique, resolution=MIXED[::-1])
    np.testing.assert_allclose(turned, first, atol=1e-6)
    for order in ("object", "triangle"):
        np.testing.assert_allclose(
            picture(technique=technique, resolution=MIXED, order=order), first, atol=1e-6
        )


def test_any_number_of_threads_and_instruction_set_gives_the_same_bits():
    options = {"resolution": MIXED, "upsampling": "depth-aware"}
    first = picture(threads=1, **options)
    np.testing.assert_array_equal(picture(threads=5, **options), first)
    before = _core.use_instruction_set("base")
    try:
        np.testing.assert_array_equal(picture(threads=2, **options), first)
    finally:
        _core.use_instruction_set(before)


def test_lights_shine_on_what_is_small():
    light = [((0.0, -1.0, -0.3), (0.9, 0.8, 0.7))]
    dim = picture(resolution=4, lights=light)
    bright = picture(resolution=4, lights=[(light[0][0], (1.8, 1.6, 1.4))])
    assert (bright - dim)[..., :3].max() > 0.1


def test_what_is_small_is_in_shadow_too():
    light = (0.0, -1.0, 0.0)
    roof = moit.Mesh([[-9, 3, -9], [9, 3, -9], [0, 3, 9]], [[0, 1, 2]], alpha=0.9)
    scene = [*SCENE, roof]
    options = {"resolution": 4, "lights": [moit.Light(light, (3, 3, 3), shadows="power4")]}
    dark = picture(scene, **options)
    bright = picture(scene, resolution=4, lights=[(light, (3, 3, 3))])
    assert (bright - dark)[..., :3].max() > 0.1
    # shadows are of lists of fragments, which the core joins
    with pytest.warns(RuntimeWarning, match="composited on the CPU.*: targets are joined"):
        report = picture(scene, device=gpu.device(), exact=True, report=True, **options)
    assert report.way == "replay"
    np.testing.assert_allclose(report.image, dark, atol=1e-5)


@pytest.mark.parametrize("device", ["cpu", "gpu"])
def test_empty_scenes_and_meshes_are_nothing(device):
    if device == "gpu":
        device = gpu.device()
    empty = moit.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int), alpha=0.5)
    away = pane(30.0)  # behind the camera
    expected = np.broadcast_to(np.float32([*BEHIND, 0]), (29, 46, 4))
    for scene in ([], [empty], [empty, away]):
        found = picture(scene, resolution=4, device=device, exact=True, target="rgba32f")
        np.testing.assert_array_equal(found, expected)
    # beside what is seen
    found = picture([empty, *SCENE], resolution=[8, *MIXED])
    np.testing.assert_array_equal(found, picture(resolution=MIXED))


def test_squares_larger_than_the_picture_are_one_pixel():
    plane = pane(0)
    for size in ((1, 1), (3, 2), (1, 9)):
        np.testing.assert_allclose(
            picture(plane, size=size, camera=AHEAD, resolution=8),
            picture(plane, size=size, camera=AHEAD),
            atol=1e-6,
        )


@pytest.mark.parametrize(
    ("resolution", "error", "match"),
    [
        (3, ValueError, "resolution: expected one of 1, 2, 4 and 8, got 3"),
        (0, ValueError, "got 0"),
        (-2, ValueError, "got -2"),
        (2.0, TypeError, "resolution: expected one of 1, 2, 4 and 8, got 2.0"),
        (True, TypeError, "got True"),
        ("4", TypeError, "got '4'"),
        ([1, 2], ValueError, "one for each of 16 meshes, got 2"),
        ([16] * 16, ValueError, r"resolution\[0\]: expected one of 1, 2, 4 and 8, got 16"),
        ({16: 2}, ValueError, "one of 16 meshes, got 16"),
        ({"smoke": 2}, TypeError, "numbers of meshes, from 0, got 'smoke'"),
        (None, TypeError, "got None"),
    ],
)
def test_bad_factors_say_what_was_found(resolution, error, match):
    with pytest.raises(error, match=match):
        picture(resolution=resolution)


def test_techniques_whose_state_does_not_add_up_are_refused():
    for technique in ("power6", "sorted", "mlab2", "moment-transparency"):
        with pytest.raises(ValueError, match=f"weighted-average, wboit.*got {technique}"):
            picture(technique=technique, resolution=2)
    with pytest.raises(ValueError, match="upsampling: expected 'bilinear', 'depth-aware'"):
        picture(resolution=2, upsampling="nearest")


def test_the_core_guards_its_pictures():
    fields = moit.technique("wboit").fields_for_core(np.dtype(np.float32))
    sums, walls = np.zeros((4, 6, 5)), np.ones((4, 6), np.float32)
    good = (1, sums, walls)
    for pictures in (
        [],
        [(2, sums, walls)],
        [good, (2, sums, walls)],
        [good, (0, sums, walls)],
        [(1, sums[..., :4], walls)],
        [good] * 9,
    ):
        with pytest.raises(ValueError, match=r"pictures|shapes"):
            _core.join_targets(fields, pictures, False, np.zeros((4, 6, 3)), 1)
    with pytest.raises(ValueError, match="behind"):
        _core.join_targets(fields, [good], False, np.zeros((4, 5, 3)), 1)
    with pytest.raises(ValueError, match="technique"):
        power = moit.technique("power4").fields_for_core(np.dtype(np.float32))
        _core.join_targets(power, [good], False, np.zeros((4, 6, 3)), 1)
