"""Sums with trained weights, against their formula told a pixel at a time."""

import dataclasses

import numpy as np
import pytest
from test_splats import CAMERA, some_splats

import moit

SIZE = (40, 32)
SPLATS = some_splats(4, 60, size=-2.0)
FACTORS = np.random.default_rng(7).normal(0.3, 0.2, (60, 4))
BACKGROUND = np.array([0.2, 0.5, 0.9])


def factors_seen(factors, eye):
    """Harmonics of degree 0 and 1, of directions from the eye."""
    x, y, z = ((SPLATS.means - eye) / np.linalg.norm(SPLATS.means - eye, axis=1)[:, None]).T
    c0, c1 = 0.28209479177387814, 0.4886025119029199
    values = [np.full(len(x), c0), -c1 * y, c1 * z, -c1 * x]
    return np.maximum(sum(v * f for v, f in zip(values, factors.T, strict=True)), 0)


WEIGHTS = {
    "direct": lambda d: np.ones_like(d),
    "exponential": lambda d: np.exp(-0.4 * d**1.5),
    "linear": lambda d: np.maximum(0, 1 - d / 3),
}
TECHNIQUES = {
    "direct": moit.SortFree("direct", background=0.05),
    "exponential": moit.SortFree("exponential", sigma=0.4, power=1.5, background=0.05),
    "linear": moit.SortFree("linear", sigma=3, background=0.05),
}


@pytest.mark.parametrize("name", TECHNIQUES)
def test_pictures_are_the_quotient_of_sums(name):
    trained = moit.SortFreeSplats(SPLATS, FACTORS, TECHNIQUES[name])
    f, technique = trained.seen(CAMERA, SIZE)
    found = moit.composite(f, technique, background=BACKGROUND)[..., :3].reshape(-1, 3)
    # which splat each fragment is of, by its colour; they stand in their order
    numbered = moit.Splats(
        *(SPLATS.means, SPLATS.scales, SPLATS.rotations, SPLATS.opacities),
        colors=np.arange(60)[:, None] * np.ones(3),
        convention="3dgs-all",
    )
    marks = moit.rasterize(numbered, CAMERA, SIZE)
    shades = moit.rasterize(SPLATS.seen_by("3dgs-all"), CAMERA, SIZE).color
    factor = factors_seen(FACTORS, np.array(CAMERA.eye))
    for p in range(SIZE[0] * SIZE[1]):
        some = slice(marks.offsets[p], marks.offsets[p + 1])
        splat = np.rint(marks.color[some, 0]).astype(int)
        w = WEIGHTS[name](marks.depth[some].astype(float)) * factor[splat] * marks.alpha[some]
        expected = (0.05 * BACKGROUND + w @ shades[some]) / (0.05 + w.sum())
        np.testing.assert_allclose(found[p], expected, atol=3e-6)
    assert len(marks) > 5000


def test_the_order_of_fragments_does_not_matter():
    f, technique = moit.SortFreeSplats(SPLATS, FACTORS).seen(CAMERA, SIZE)
    found = moit.composite(f, technique)
    np.testing.assert_allclose(moit.composite(f.shuffled(3), technique), found, atol=1e-6)
    assert np.abs(moit.composite(f, "sorted") - found).max() > 0.1


def test_fragments_behind_opaque_ones_count_too():
    """Nothing ends where only the sorted see that there is an end."""
    dense = some_splats(2, 2500)
    f, _ = moit.SortFreeSplats(dense, np.ones((2500, 1))).seen(CAMERA, SIZE)
    assert len(f) == len(moit.rasterize(dense.seen_by("3dgs-all"), CAMERA, SIZE))
    assert len(f) > len(moit.rasterize(dense, CAMERA, SIZE))


def written(path, factors, info):
    """A .ply of SPLATS with columns of sort-free splatting."""
    moit.write_splats(path, SPLATS)
    header, rows = path.read_bytes().split(b"end_header\n", 1)
    names = ["f_do_0", *(f"f_ro_{k}" for k in range(factors.shape[1] - 1))]
    own = [factors]
    if info is not None:
        names.append("info")
        own.append(np.resize(info, 60)[:, None])
    more = "".join(f"property float {name}\n" for name in names).encode()
    rows = np.frombuffer(rows, "<f4").reshape(60, -1)
    rows = np.concatenate([rows, *own], axis=1).astype("<f4")
    path.write_bytes(header + more + b"end_header\n" + rows.tobytes())
    return path


def test_files_have_factors_and_the_numbers_of_the_weight(tmp_path):
    turned = FACTORS * (1, -1, -1, 1)  # a file's y points down and its z ahead
    read = moit.read_sort_free(written(tmp_path / "a.ply", turned, (0.02, 8.0)))
    assert read.technique == moit.SortFree(sigma=8.0, background=np.float32(0.02))
    np.testing.assert_allclose(read.factors, FACTORS, atol=1e-6)
    given = moit.SortFreeSplats(SPLATS, FACTORS, moit.SortFree(sigma=8, background=0.02))
    pictures = [moit.composite(*one.seen(CAMERA, SIZE)) for one in (read, given)]
    np.testing.assert_allclose(pictures[0], pictures[1], atol=2e-5)


def test_what_does_not_fit_is_refused(tmp_path):
    with pytest.raises(moit.SplatsError, match=r"factors: expected shape \(60, 1\) or .*\(60, 5\)"):
        moit.SortFreeSplats(SPLATS, np.ones((60, 5)))
    with pytest.raises(moit.SplatsError, match="factors: found numbers that are not finite"):
        moit.SortFreeSplats(SPLATS, np.full((60, 1), np.nan))
    with pytest.raises(TypeError, match="splats: expected Splats, got int"):
        moit.SortFreeSplats(3, [[1]])
    with pytest.raises(TypeError, match="technique: expected SortFree, got str"):
        moit.SortFreeSplats(SPLATS, FACTORS, "wboit")
    with pytest.raises(ValueError, match="weight: expected 'direct', 'exponential', 'linear'"):
        moit.SortFree("eq7")
    with pytest.raises(ValueError, match="background: "):
        moit.SortFree(background=0)
    with pytest.raises(moit.SplatsError, match=r"a\.ply': has no property 'info'"):
        moit.read_sort_free(written(tmp_path / "a.ply", FACTORS, None))
    with pytest.raises(moit.SplatsError, match=r"found info \[0.0, 8.0\]; needed two positive"):
        moit.read_sort_free(written(tmp_path / "b.ply", FACTORS, (0.0, 8.0)))
    with pytest.raises(moit.SplatsError, match=r"has 4 properties f_ro_\*; needed 0, 3, 8 or 15"):
        moit.read_sort_free(written(tmp_path / "c.ply", np.ones((60, 5)), (0.02, 8.0)))


def test_a_technique_of_sums_is_used_as_any_other():
    f, technique = moit.SortFreeSplats(SPLATS, FACTORS).seen(CAMERA, (16, 12))
    # a weight is no transmittance: it may count a colour more than once
    rows = moit.check_technique(technique).rows
    assert [row.name for row in rows if row.ok is False] == ["range"]
    assert np.isfinite(moit.composite(f, technique)).all()
    other = dataclasses.replace(technique, sigma=2.0)
    assert str(other) != str(technique)
