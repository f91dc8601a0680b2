"""Pictures of fragments that a GPU lists: slices of them, whose places the core finds by marks, and
what is read and given to passes over arrays."""

import gpu
import numpy as np
import pytest

import moit
from moit.gpu.device import Device
from moit.gpu.listed import Listed
from moit.rendering import making

SIZE = (18, 13)
CAMERA = moit.Camera(eye=(0.2, 0.1, 3.0), near=0.5, far=20.0)
BACKGROUND = np.random.default_rng(3).random((*SIZE[::-1], 3), np.float32)


def scene_of(kind):
    """Triangles, some of them opaque, with points; or splats, some of them thick, and what is
    opaque through their middle."""
    rng = np.random.default_rng(4)
    if kind == "splats":
        given = (rng.uniform(-1, 1, (12, 3)), rng.uniform(0.1, 0.5, (12, 3)))
        given += (rng.normal(size=(12, 4)), rng.uniform(0.2, 0.9, 12))
        flat = moit.Splats(*given, colors=rng.random((12, 3)))
        wall = moit.Mesh([[-2, -2, -0.2], [2, -2, 0.4], [0, 2, 0]], [[0, 1, 2]], rng.random(3), 1.0)
        return [flat, flat[::4].seen_by("exact", thick=True), wall]
    if kind == "flat":
        return scene_of("splats")[:1]
    panes = [
        moit.Mesh(rng.uniform(-1.6, 1.6, (3, 3)), [[0, 1, 2]], rng.random(3), alpha)
        for alpha in (*rng.uniform(0.1, 0.7, 10), 1.0)
    ]
    return [*panes, moit.Points(rng.uniform(-1, 1, (9, 3)), 0.3, alpha=0.4)]


def made_by(device, kind, technique, way="arrays"):
    options = {"camera": CAMERA, "background": BACKGROUND, "exact": True}
    options |= {"report": True, "target": "rgba32f"}
    options |= {"ordered": "replay"} if way == "replay" else {}
    made = moit.render(scene_of(kind), technique, SIZE, device=device, **options)
    assert (made.device, made.way, bool(made.reason)) == ("gpu", way, way == "arrays")
    return made.image


@pytest.mark.parametrize(
    ("kind", "technique", "way"),
    [
        ("triangles", "slices16(cells=128)", "replay"),
        ("flat", "slices16(cells=128,table='tile',tile=12,resolution=2,total='byte')", "replay"),
        ("triangles", "slices5(cells=64,table='pixel',inside='power4',resolution=3)", "replay"),
        ("triangles", "avboit(count=16)", "replay"),
        ("flat", "avboit(count=9,cells=64,resolution=3,low_resolution='average')", "replay"),
        ("triangles", "slices5(cells=64,resolution=3,upsampling='depth-aware')", "arrays"),
        ("triangles", "power4(depth_range='pixel')", "arrays"),
        ("splats", "power6", "arrays"),
    ],
)
def test_pictures_are_those_of_the_cpu(kind, technique, way):
    device = gpu.device()
    found = made_by(device, kind, technique, way)
    expected = moit.render(scene_of(kind), technique, SIZE, camera=CAMERA, background=BACKGROUND)
    if device.software:
        np.testing.assert_array_equal(found, expected)
    else:
        np.testing.assert_allclose(found, expected, atol=1e-4)


@pytest.mark.parametrize("kind", ["triangles", "splats"])
def test_bands_of_rows_make_the_same_picture(kind, monkeypatch):
    device, technique = gpu.device(), "power4(depth_range='pixel')"
    expected = made_by(device, kind, technique)
    bands, rows = [], Listed.rows
    count = len(moit.rasterize(scene_of(kind), CAMERA, SIZE))
    monkeypatch.setattr(making, "MOST_LISTED", count // 3)
    monkeypatch.setattr(Listed, "rows", lambda *args: bands.append(args[1:]) or rows(*args))
    np.testing.assert_array_equal(made_by(device, kind, technique), expected)
    assert len(bands) >= 3
    assert [top for top, _ in bands] == [0, *(bottom for _, bottom in bands[:-1])]


def test_slices_of_the_whole_are_found_at_once_however_many_fragments_there_are(monkeypatch):
    technique = "slices5(cells=64,resolution=3,upsampling='depth-aware')"
    expected = moit.render(scene_of("triangles"), technique, SIZE, camera=CAMERA)
    for most in ("MOST_LISTED", "MOST_AT_ONCE"):
        monkeypatch.setattr(making, most, 50)
    found = moit.render(scene_of("triangles"), technique, SIZE, camera=CAMERA)
    np.testing.assert_array_equal(found, expected)
    found = moit.render(scene_of("triangles"), technique, SIZE, camera=CAMERA, device=gpu.device())
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_rows_have_the_range_of_the_whole_where_nothing_is_transparent(monkeypatch):
    device, listed, rows = gpu.device(), [], Listed.rows
    monkeypatch.setattr(Listed, "rows", lambda *args: listed.append(args[0]) or rows(*args))
    wall = moit.Mesh([[-2, -2, -1], [2, -2, -1], [0, 2, 1]], [[0, 1, 2]], (1, 0, 0), 1.0)
    moit.render(wall, "power4(depth_range='pixel')", SIZE, camera=CAMERA, device=device)
    whole = rows(listed[0], 0, SIZE[1])
    bands = listed[0].bands(len(whole) // 3)
    parts = [rows(listed[0], *band) for band in bands]
    assert len(bands) >= 3
    assert {part.depth_range for part in parts} == {whole.depth_range}
    assert [part.origin for part in parts] == [(top, 0) for top, _ in bands]
    np.testing.assert_array_equal(np.concatenate([part.depth for part in parts]), whole.depth)


def test_what_reads_all_rows_gets_them_by_parts():
    device, technique = gpu.device(), "avboit(count=16)"
    expected = made_by(device, "triangles", technique, "replay")
    with pytest.MonkeyPatch.context() as small:
        small.setattr("moit.gpu.meshes.Drawing.most_fragments", 200)
        np.testing.assert_array_equal(made_by(device, "triangles", technique), expected)
        # lists that no buffer holds are read by parts, too, whatever goes over them
        made = moit.render(
            scene_of("triangles"), "sorted", SIZE, camera=CAMERA, device=device, report=True
        )
    assert (made.device, made.way) == ("gpu", "arrays")
    assert made.reason.endswith("fragments or more a list holds 200")
    expected = moit.render(scene_of("triangles"), "sorted", SIZE, camera=CAMERA)
    np.testing.assert_allclose(made.image, expected, atol=1e-6)


def test_what_no_pass_reaches_the_core_composites(monkeypatch):
    device, technique = gpu.device(), moit.PowerMoments(4, depth_range="pixel")
    expected = moit.render(scene_of("splats"), technique, SIZE, camera=CAMERA)

    def refuse(*_):
        raise moit.GpuError("offsets: a pixel has more fragments than fit")

    monkeypatch.setattr("moit.gpu.questions.Question.composite", refuse)
    with pytest.warns(RuntimeWarning, match="on the CPU.*: thick Splats .*; over arrays: offsets"):
        made = moit.render(
            scene_of("splats"), technique, SIZE, camera=CAMERA, device=device, report=True
        )
    assert (made.device, made.way) == ("cpu", "replay")
    np.testing.assert_allclose(made.image, expected, atol=1e-6)


def test_where_tables_do_not_fit_the_core_makes_the_picture(monkeypatch):
    device, technique = gpu.device(), "slices5(cells=64,table='tile',tile=2)"
    monkeypatch.setattr(Device, "storage_bytes", 12 * 64 * 9 * 7 - 1)
    said = "on the CPU.*: tables takes 48384 bytes; over arrays: table: 63 tables"
    with pytest.warns(RuntimeWarning, match=said):
        found = moit.render(scene_of("triangles"), technique, SIZE, camera=CAMERA, device=device)
    expected = moit.render(scene_of("triangles"), technique, SIZE, camera=CAMERA)
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize(
    "technique",
    [
        *("neural-slices5(bits=6)", "neural-slices16(bits=16)", "anchors4", "anchors2(cells=3)"),
        *("slices5(cells=64,table='pixel')", "slices9(cells=64,resolution=3,total='full')"),
        "slices16(cells=128,table='tile',tile=12,resolution=2,total='byte')",
    ],
)
def test_atomics_need_no_lists(technique):
    """The same whole numbers as over lists: one more or less would show by 1e-4 at least."""
    # what covers nothing widens no extent
    clear = moit.Mesh([[-4, -3, 2], [4, -3, 2], [0, 5, 2]], [[0, 1, 2]], (1, 1, 1), 0.0)
    for kind in ("triangles", "flat"):
        images = []
        for ordered in (None, "replay"):
            made = moit.render(
                [*scene_of(kind), clear], technique, SIZE, camera=CAMERA, background=BACKGROUND,
                device=gpu.device(), exact=True, target="rgba32f", report=True, ordered=ordered,
            )  # fmt: skip
            assert made.device == "gpu" and made.way == ("replay" if ordered else "add")
            assert ("fragments" in made.memory) == bool(ordered)
            images.append(made.image)
        # colours and what is let through are floats in one, doubles in the other
        np.testing.assert_allclose(*images, atol=2e-6)
        assert np.ptp(images[0]) > 0.5
