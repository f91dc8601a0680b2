"""Simplified deep images: the certificate holds at every depth, and samples are few."""

from itertools import pairwise

import deep_model
import numpy as np
import OpenEXR
import pytest

import moit
from moit import _core
from moit.__main__ import main
from moit.formats.deep_bands import LEAST_MEMORY

ERROR = 1 / 255


def image(
    seed, most=24, volumes=False, colored=False, alpha=0.03, opaque=0.1, bright=1.0, pixels=20
):
    """Random rays, of which some end opaque, in no order."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, pixels)
    n = int(counts.sum())
    alphas = rng.uniform(0, alpha, n) * (rng.random(n) > 0.05)
    alphas[rng.random(n) < opaque / most] = 1
    depth = rng.uniform(1, 9, n).round(1)
    thick = rng.exponential(0.1, n) * (rng.random(n) < 0.7) * volumes
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        depth.astype(np.float32),
        alphas.astype(np.float32),
        (bright * rng.random((n, 3))).astype(np.float32),
        back=(depth + thick * (alphas < 1)).astype(np.float32) if volumes else None,
        transmission=(rng.random((n, 3)) * 0.5).astype(np.float32) if colored else None,
        emission=(0.02 * bright * rng.random((n, 3)) * (rng.random((n, 1)) < 0.2)).astype("f4"),
        shape=(2, pixels // 2),
    )


def seen(pieces, depth):
    """(transmittance (3,), light (3,)) in front of a depth, of tidy pieces: in float64."""
    light, through = np.zeros(3), np.ones(3)
    for near, far, opacity, p in pieces:
        if near >= depth:
            break
        share = 1.0 if far <= depth else (depth - near) / (far - near)
        a, own = deep_model.part(opacity, p, share)
        light, through = light + through * own, through * (1 - a)
    return through, light


def assert_certified(before, after, error):
    """Compares them at random depths, and right in front of and behind everything."""
    rng = np.random.default_rng(9)
    worst = 0.0
    for pixel in range(len(before.counts)):
        true, less = (deep_model.tidy(deep_model.samples_of(f, pixel)) for f in (before, after))
        ends = np.array([depth for one in (*true, *less) for depth in one[:2]])
        depths = np.concatenate(
            [rng.uniform(0, 15, 12), ends, np.nextafter(ends, 99), np.nextafter(ends, -99), [1e9]]
        )
        every = [(seen(true, z), seen(less, z)) for z in depths]
        scale = max(1.0, max(np.abs(one[1]).max() for one, _ in every))
        for (t, c), (t_less, c_less) in every:
            worst = max(worst, np.abs(t - t_less).max(), np.abs(c - c_less).max() / scale)
    assert worst <= error * (1 + 1e-6)  # the model divides by alpha where the file does not
    return worst


def simplified(tmp_path, f, half=False, **how):
    moit.write_deep(tmp_path / "a.exr", f, half=half)
    found = moit.deep.simplify(tmp_path / "a.exr", tmp_path / "b.exr", **how)
    return (
        moit.read_deep(tmp_path / "a.exr", tidy=False),
        moit.read_deep(tmp_path / "b.exr", tidy=False),
        found,
    )


CASES = {
    "surfaces": ({}, {}),
    "halves": ({}, {"half": True}),
    "bright": ({"bright": 50.0}, {"half": True}),
    "volumes": ({"volumes": True}, {}),
    "volumes in halves": ({"volumes": True}, {"half": True, "error": 0.02}),
    "volumes for surfaces": ({"most": 60, "alpha": 0.008, "pixels": 6}, {"volumes": True}),
    "colored": ({"colored": True, "volumes": True}, {}),
    "long numbers": ({}, {"short_numbers": False}),
    "coarse": ({"alpha": 0.6}, {"error": 0.1}),
}


@pytest.mark.parametrize("case", CASES)
def test_the_certificate_holds(tmp_path, case):
    of_image, how = CASES[case]
    error = how.get("error", ERROR)
    before, after, found = simplified(tmp_path, image(len(case), **of_image), **how)
    worst = assert_certified(before, after, error)
    assert found.samples_before == len(before) and found.samples_after == len(after)
    assert len(after) < 0.9 * len(before)
    assert found.transmittance_error <= error and found.light_error <= error
    # what it says was found is what is found, up to depths that were not tried
    assert max(found.transmittance_error, found.light_error) >= worst * (1 - 1e-6)
    metadata = after.frame.metadata
    assert metadata["moit:simplifyError"] == error
    assert metadata["moit:simplifyTransmittanceError"] == found.transmittance_error
    assert metadata["moit:simplifyLightError"] == found.light_error
    assert set(after.depth) <= {*before.depth, *([] if before.back is None else before.back)}


def test_opaque_pixels_stay_opaque(tmp_path):
    before, after, _ = simplified(tmp_path, image(3, opaque=2.0, pixels=60), error=0.05)
    for pixel in range(len(before.counts)):
        ends = [
            f.alpha[f.offsets[pixel] : f.offsets[pixel + 1]].max(initial=0) for f in (before, after)
        ]
        assert (ends[0] == 1) == (ends[1] == 1)


def least(pieces, error):
    """How few steps a ray can be, by trying all that a step can stand for: its states, each a row,
    are in parts whose numbers are within twice the error."""
    states = [np.array([1.0, 1, 1, 0, 0, 0])]
    for _, _, opacity, light in pieces:
        through = states[-1][:3] * (1 - opacity)
        states.append(np.concatenate([through, states[-1][3:] + states[-1][:3] * light]))
        if not through.any():
            break
    states = np.array(states)
    tolerance = error * np.where(np.arange(6) < 3, 1, max(1, states[:, 3:].max()))
    n = len(states)
    steps = np.full(n + 1, np.inf)
    for j in range(1, n + 1):
        if (np.abs(states[:j] - states[0]) <= tolerance).all() and states[j - 1, 0] > 0:
            steps[j] = 0
        for i in range(1, j):
            part = states[i:j]
            dark = part[-1, 0] == 0
            fits = (np.ptp(part, axis=0) <= 2 * tolerance).all()
            if fits and (not dark or (part[:, :3] <= error).all()):
                steps[j] = min(steps[j], steps[i] + 1)
    return steps[n]


def test_surfaces_are_as_few_as_can_be(tmp_path):
    before, after, found = simplified(tmp_path, image(5, most=12, alpha=0.5, pixels=60), error=0.03)
    wanted = [
        least(deep_model.tidy(deep_model.samples_of(before, pixel)), 0.03 * (1 - 1e-6))
        for pixel in range(len(before.counts))
    ]
    assert after.counts.tolist() == wanted
    assert found.pixels == 60


def test_a_slope_stands_for_many_steps(tmp_path):
    n = 100
    depth = np.linspace(1, 2, n).astype(np.float32)
    f = moit.Fragments([0, n], depth, np.full(n, 0.003, np.float32), np.ones((n, 3), np.float32))
    before, after, _ = simplified(tmp_path, f, volumes=True)
    assert len(after) == 1 and after.back is not None
    assert_certified(before, after, ERROR)
    _, steps, _ = simplified(tmp_path, f)
    assert steps.back is None and len(steps) > 20


def test_numbers_of_a_file_seldom_spoil_a_plan_with_volumes(tmp_path):
    rng = np.random.default_rng(0)
    pixels, each = 144, 30
    front = rng.uniform(1, 9, pixels * each)
    f = moit.Fragments(
        np.arange(pixels + 1) * each,
        front.astype("f4"),
        rng.uniform(0, 0.05, pixels * each).astype("f4"),
        rng.random((pixels * each, 3), dtype="f4"),
        back=(front + rng.exponential(0.5, pixels * each)).astype("f4"),
        shape=(12, 12),
    )
    moit.write_deep(tmp_path / "a.exr", f, half=True)
    for error, fewer, kept in ((ERROR, 0.85, 0.2), (4 * ERROR, 0.42, 0.02)):
        found = moit.deep.simplify(tmp_path / "a.exr", tmp_path / "b.exr", error)
        assert found.samples_after < fewer * found.samples_before
        assert found.pixels_kept <= kept * pixels


def ids_file(path, seed=0):
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, 30, 40)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    n = int(offsets[-1])
    flat = {
        "Z": rng.permutation(n).astype(np.float32),
        "A": rng.uniform(0, 0.02, n).astype(np.float16),
        "objectId": rng.integers(1, 4, n).astype(np.float32),
        "kind": rng.integers(0, 2, n).astype(np.uint32),
    }
    flat |= {one: (rng.random(n) * flat["A"]).astype(np.float16) for one in "RGB"}
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    pixels = {k: _core.split_pixels(v, offsets).reshape(4, 10) for k, v in flat.items()}
    OpenEXR.File(header, pixels).write(str(path))
    return offsets, flat


def ids_along_rays(path):
    """For each pixel the pairs of ids from front to back, without repetitions."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        flat = {k: _core.join_pixels(v.pixels) for k, v in file.channels().items()}
    offsets = np.concatenate([[0], np.cumsum(flat["Z"][0])])
    found = []
    for i, j in pairwise(offsets):
        order = np.argsort(flat["Z"][1][i:j], kind="stable")
        pairs = [(flat["objectId"][1][i:j][k], flat["kind"][1][i:j][k]) for k in order]
        found.append([pair for n, pair in enumerate(pairs) if n == 0 or pairs[n - 1] != pair])
    return found


def test_ids_are_kept_apart(tmp_path):
    a, b, c = (tmp_path / f"{name}.exr" for name in "abc")
    ids_file(a)
    kept = moit.deep.simplify(a, b, keep_ids=True)
    assert kept.samples_after < kept.samples_before
    assert ids_along_rays(b) == ids_along_rays(a)
    loose = moit.deep.simplify(a, c)
    assert loose.samples_after < kept.samples_after
    named = moit.deep.simplify(a, c, keep_ids=["kind"])
    assert loose.samples_after < named.samples_after < kept.samples_after
    with pytest.raises(ValueError, match="keep_ids: there is no channel 'nobody'"):
        moit.deep.simplify(a, c, keep_ids=["nobody"])
    with pytest.raises(TypeError, match="keep_ids: expected True, False or names"):
        moit.deep.simplify(a, c, keep_ids="kind")


def test_errors_add_up_in_the_header(tmp_path):
    moit.write_deep(tmp_path / "a.exr", image(1))
    first = moit.deep.simplify(tmp_path / "a.exr", tmp_path / "b.exr", error=0.01)
    second = moit.deep.simplify(tmp_path / "b.exr", tmp_path / "c.exr", error=0.05)
    metadata = moit.inspect(tmp_path / "c.exr").parts[0].frame.metadata
    assert metadata["moit:simplifyError"] == 0.01 + 0.05
    found = first.light_error + second.light_error
    assert metadata["moit:simplifyLightError"] == pytest.approx(found)


def test_bands_change_nothing(tmp_path):
    f = moit.scenes.load("hair", (96, 64))
    moit.write_deep(tmp_path / "a.exr", f)
    found = [
        moit.deep.simplify(tmp_path / "a.exr", tmp_path / f"{memory}.exr", memory=memory)
        for memory in (LEAST_MEMORY, 1 << 30)
    ]
    assert found[0] == found[1] and found[0].samples_after < found[0].samples_before
    one, other = ((tmp_path / f"{memory}.exr").read_bytes() for memory in (LEAST_MEMORY, 1 << 30))
    assert one == other


@pytest.mark.parametrize(("error", "kind"), [(0, ValueError), (1, ValueError), ("a", TypeError)])
def test_errors_that_mean_nothing_are_refused(tmp_path, error, kind):
    moit.write_deep(tmp_path / "a.exr", image(1))
    with pytest.raises(kind, match="error: expected a number"):
        moit.deep.simplify(tmp_path / "a.exr", tmp_path / "b.exr", error=error)


def test_the_shell_simplifies(tmp_path, capsys):
    a, b, c = (str(tmp_path / f"{name}.exr") for name in "abc")
    moit.write_deep(a, image(1))
    assert main(["simplify", a, "-o", b, "--error", "0.01", "--volumes"]) == 0
    found = moit.deep.simplify(a, c, 0.01, volumes=True)
    assert capsys.readouterr().out == f"{b}\n{found}\n"
    with open(b, "rb") as one, open(c, "rb") as other:
        assert one.read() == other.read()
    with pytest.raises(SystemExit):
        main(["simplify", "--help"])
    assert "example: moit simplify" in capsys.readouterr().out


def test_depths_may_move_by_their_error_alone(tmp_path):
    before, after, found = simplified(tmp_path, image(6), depth_error=2e-3)
    assert found.transmittance_error <= ERROR
    assert len(set(after.depth)) > 20  # of about 80: those of a tenth each from 1 to 9
    nearest = np.abs(after.depth[:, None] - np.unique(before.depth)).min(axis=1)
    assert 0 < nearest.max() <= 2e-3 * 9 and (nearest <= 2e-3 * after.depth * 1.01).all()
    digits = np.array([float(z).as_integer_ratio()[1] for z in after.depth])
    assert digits.max() <= 512  # of float32's 2^22 at such depths
    for pixel in range(len(before.counts)):
        true, less = (deep_model.tidy(deep_model.samples_of(f, pixel)) for f in (before, after))
        for z in np.arange(1.05, 9.2, 0.1):  # between where depths were
            (t, c), (t_less, c_less) = seen(true, z), seen(less, z)
            scale = max(1.0, seen(true, 1e9)[1].max())
            assert max(np.abs(t - t_less).max(), np.abs(c - c_less).max() / scale) <= ERROR * 1.001
    with pytest.raises(ValueError, match="depth_error: expected a number in"):
        moit.deep.simplify(tmp_path / "a.exr", tmp_path / "b.exr", depth_error=1)


MOVED = {
    "surfaces": ({}, {}, 1e-3),
    "far": ({"opaque": 2.0, "alpha": 0.3}, {"half": True, "error": 0.02}, 0.05),
    "volumes": ({"volumes": True, "most": 12}, {}, 1e-3),
    "colored": ({"colored": True, "bright": 20.0}, {"error": 0.03}, 0.01),
}


@pytest.mark.parametrize("case", MOVED)
def test_holdouts_at_random_depths_are_certified_though_depths_move(tmp_path, case):
    """What is in front of a depth is within the error of what was in front of one near it."""
    of_image, how, share = MOVED[case]
    rng = np.random.default_rng(len(case))
    before, after, _ = simplified(
        tmp_path, image(11, pixels=8, **of_image), depth_error=share, **how
    )
    worst = 0.0
    for pixel in range(len(before.counts)):
        true, less = (deep_model.tidy(deep_model.samples_of(f, pixel)) for f in (before, after))
        ends = np.array([depth for one in true for depth in one[:2]])
        made = np.array([depth for one in less for depth in one[:2]])
        scale = max(1.0, seen(true, 1e9)[1].max())
        for z in (*rng.uniform(0, 11, 12), *made, *np.nextafter(made, 99)):
            low, high = z / (1 + share), z / (1 - share)
            near = np.append(ends[(ends > low) & (ends < high)], [low, high])
            # without volumes what is seen changes at ends alone
            between = np.linspace(low, high, 25) if case == "volumes" else near
            t_less, c_less = seen(less, z)
            worst = max(
                worst,
                min(
                    max(np.abs(t - t_less).max(), np.abs(c - c_less).max() / scale)
                    for t, c in (seen(true, d) for d in {*near, *np.nextafter(near, 99), *between})
                ),
            )
    error = how.get("error", ERROR)
    assert 0.3 * error < worst <= error * (1.05 if case == "volumes" else 1 + 1e-6)


def test_a_certificate_is_of_the_worst_of_all_bands():
    from moit.deep.simplifying import Certificate, Simplifying

    class Rows:
        offsets = np.array([0, 2])

        def __len__(self):
            return 2

    simplifying = Simplifying.__new__(Simplifying)
    simplifying.found = Certificate(0.1, 0.0, 0.0, 0, 0, 3, 0)
    for worst in ([0.01, 0.02], [0.03, 0.05], [0.02, 0.04]):
        simplifying._note(Rows(), np.array([1]), np.array([worst]))
    found = simplifying.found
    assert (found.transmittance_error, found.light_error) == (0.03, 0.05)
    assert (found.samples_before, found.samples_after) == (6, 3)
