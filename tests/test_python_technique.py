"""Techniques of one's own, in Python: held to those of the core, sent about, and refused."""

import dataclasses
import importlib.util
import pickle
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from gpu import device
from own_techniques import (
    EXACT,
    PICTURES,
    Fog,
    PythonTechnique,
    check,
    close,
    every_picture,
    exact,
    exact_curve,
    halves,
)
from small import some_fragments

import moit
from moit.python_techniques import questions

# ---- Held to the core ------------------------------------------------------------------------


@every_picture
def test_what_sorts_in_python_is_sorted(name):
    """Where there is coloured transmission `sorted` has a curve for each channel, others one."""
    f = PICTURES[name]
    behind = (0.2, 0.5, 4.0)
    close(moit.transmittance(f, EXACT), moit.transmittance(f, "sorted"), f.dtype)
    close(moit.total_transmittance(f, EXACT), moit.total_transmittance(f, "sorted"), f.dtype)
    depths = [1.0, 3.0, 5.5, 20.0]
    close(moit.transmittance(f, EXACT, depths), moit.transmittance(f, "sorted", depths), f.dtype)
    if name != "coloured":
        image = moit.composite(f, EXACT, background=behind)
        close(image, moit.composite(f, "sorted", background=behind), f.dtype)


def wrapped(name, **options):
    """A built-in technique behind Python functions."""
    one = moit.technique(name)
    curve = None
    if one.has_curve:

        def curve(f, depths):
            return moit.transmittance(f, one, depths, cull_opaque=False).reshape(-1, len(depths))

    def transmittance(f):
        return moit.transmittance(f, one, cull_opaque=False)

    def total(f):
        return moit.total_transmittance(f, one, cull_opaque=False).ravel()

    return PythonTechnique(f"my {name}", transmittance, curve=curve, total=total, **options)


BUILT_IN = {
    "power4": True,
    "power6(overestimation=0.5)": True,
    "power4(normalize=False)": False,
    "trig3": True,
    "fourier7": True,
    "wavelet8": True,
    "deep-shadow": True,
    "moment-transparency": True,
    "wboit-eq7": True,
    "weighted-average": False,
    "hybrid4": False,
    "unsorted": False,
}


@pytest.mark.parametrize("one", BUILT_IN)
@pytest.mark.parametrize("name", [n for n in PICTURES if n not in ("coloured", "grey", "single")])
def test_built_in_techniques_behind_python_are_themselves(one, name):
    f = PICTURES[name]
    if name == "emission" and one.startswith("wboit"):
        pytest.skip("weighted blending has a rule of its own for emission")
    if name == "volumes" and moit.technique(one).thick in ("moments", "waves", "cells"):
        pytest.skip("it knows extents; what is of Python is given volumes in pieces")
    mine = wrapped(one, normalize=BUILT_IN[one])
    behind = np.random.default_rng(0).random((*f.shape, 3))
    for culls in (True, False):
        options = {"cull_opaque": culls}
        close(
            moit.transmittance(f, mine, **options), moit.transmittance(f, one, **options), f.dtype
        )
        image = moit.composite(f, mine, background=behind, **options)
        expected = moit.composite(f, one, background=behind, **options)
        most = 1e-9 if f.dtype == np.float64 else 1e-6
        np.testing.assert_allclose(image, expected, rtol=0, atol=most)
    if mine.has_curve:
        depths = np.linspace(*f.depth_range, 9)
        close(moit.transmittance(f, mine, depths), moit.transmittance(f, one, depths), f.dtype)


@pytest.mark.parametrize("one", ["power4", "trig2", "wavelet8"])
@pytest.mark.parametrize("name", ["coloured", "grey"])
def test_with_transmission_there_is_one_curve_of_the_net_coverage(one, name):
    """`total` of these is a product, which is what channels are given."""
    f = PICTURES[name]
    inside = wrapped(one)
    mine = PythonTechnique("mine", inside.transmittance)
    behind = (0.5, 1.0, 2.0)
    expected = moit.composite(f, one, background=behind)
    np.testing.assert_allclose(
        moit.composite(f, mine, background=behind), expected, rtol=0, atol=2e-3
    )  # their alpha is limited where logarithms are taken
    soft = moit.Fragments(
        f.offsets, f.depth, 0.9 * f.alpha, f.color, transmission=f.transmission, shape=f.shape
    )
    np.testing.assert_allclose(
        moit.composite(soft, mine), moit.composite(soft, one), rtol=0, atol=1e-6
    )


def gather_moments(f):
    b0, b = moit.moments.gather(f, "power4", cull_opaque=False)
    near, far = np.log(f.depth_range)
    return np.concatenate([b0[:, None], b, np.full((len(b0), 2), (near, far))], axis=1)


def read_moments(state, depth, alpha):
    near, far = state[:, 5], state[:, 6]
    z = 2 * (np.log(depth) - near) / (far - near) - 1
    T = moit.moments.transmittance("power4", state[:, 0].copy(), state[:, 1:5].copy(), z[:, None])
    return T[:, 0]


def test_two_passes_of_moments_are_power4():
    f = PICTURES["opaque"]
    mine = PythonTechnique("mine", None, gather=gather_moments, read=read_moments)
    assert mine.has_curve
    np.testing.assert_allclose(
        moit.transmittance(f, mine), moit.transmittance(f, "power4"), rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(
        moit.composite(f, mine), moit.composite(f, "power4"), rtol=0, atol=2e-3
    )
    depths = np.linspace(*f.depth_range, 7)
    np.testing.assert_allclose(
        moit.transmittance(f, mine, depths),
        moit.transmittance(f, "power4", depths),
        rtol=0,
        atol=1e-9,
    )


def average(f):
    """The colours of weighted average by hand: one colour for all, n layers of one opacity."""
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    alpha = np.bincount(pixel, f.alpha, minlength=len(f.counts)) / np.maximum(f.counts, 1)
    through = (1 - alpha) ** f.counts
    share = np.divide(1 - through, alpha * f.counts, out=np.zeros_like(alpha), where=alpha > 0)
    return share[pixel], through


def test_weighted_average_in_numpy_is_the_built_in_one():
    f = PICTURES["opaque"]
    mine = PythonTechnique(
        "average", lambda f: average(f)[0], total=lambda f: average(f)[1], normalize=False
    )
    close(moit.composite(f, mine), moit.composite(f, "weighted-average"), f.dtype)


def test_composite_of_ones_own_gets_the_background_and_opaque_surfaces():
    f = PICTURES["opaque"]

    def over(fragments, background):
        assert background.shape == (len(fragments.counts), 3)
        T = exact(fragments)
        pixel = np.repeat(np.arange(len(fragments.counts)), fragments.counts)
        total = exact_curve(fragments, [np.inf])
        image = np.concatenate([total * background, 1 - total], axis=1)
        np.add.at(image[:, :3], pixel, (T * fragments.alpha)[:, None] * fragments.color)
        return image

    def shaped(fragments, background):
        return over(fragments, background).reshape(*fragments.shape, 4)

    behind = np.random.default_rng(0).random((*f.shape, 3))
    expected = moit.composite(f, "sorted", background=behind)
    for function in (over, shaped):
        mine = PythonTechnique("mine", exact, composite=function)
        close(moit.composite(f, mine, background=behind), expected, f.dtype)


def test_bounds_are_ones_own_or_what_the_total_proves():
    f = PICTURES["opaque"]

    def certain(fragments, depths):
        answer = exact(fragments) if depths is None else exact_curve(fragments, depths)
        return answer, answer

    for depths in (None, [2.0, 5.0]):
        for bound in moit.bounds(f, PythonTechnique("mine", exact, bounds=certain), depths):
            close(bound, moit.transmittance(f, "sorted", depths), f.dtype)
        lower, upper = moit.bounds(f, PythonTechnique("mine", exact), depths)
        T = moit.transmittance(f, "sorted", depths)
        assert ((lower <= T + 1e-12) & (T <= upper + 1e-12)).all()
        for one, other in zip(
            moit.bounds(f, "weighted-average", depths), (lower, upper), strict=True
        ):
            np.testing.assert_array_equal(one, other)


def test_weights_that_are_all_nothing_still_cover():
    f = PICTURES["opaque"]
    image = moit.composite(f, PythonTechnique("nothing", lambda f: np.zeros(len(f))))
    equal = moit.composite(f, PythonTechnique("equal", lambda f: np.ones(len(f))))
    np.testing.assert_allclose(image, equal, rtol=0, atol=1e-12)


# ---- What functions get, and may give ----------------------------------------------------------


def test_functions_get_the_picture_without_what_is_hidden():
    f = PICTURES["opaque"]
    seen = []

    def look(fragments):
        seen.append(fragments)
        return halves(fragments)

    moit.composite(f, PythonTechnique("look", look))
    (given,) = seen
    assert isinstance(given, moit.Fragments)
    assert (given.shape, given.depth_range, given.origin) == (f.shape, f.depth_range, f.origin)
    assert given.dtype == f.dtype
    assert 0 < len(given) < len(f)
    assert given.alpha.max() < 1
    assert given.color is not None


def test_functions_may_write_to_what_they_get_and_change_nothing():
    f = PICTURES["surfaces"]
    before = f.depth.copy()

    def spoil(fragments):
        fragments.depth.__dlpack__()  # what cannot be written to cannot be shared so
        for name in ("offsets", "depth", "alpha", "color"):
            getattr(fragments, name)[...] = 0
        return np.ones(len(fragments))

    def spoil_curve(fragments, depths):
        depths[:] = 0
        return np.ones((len(fragments.counts), len(depths)))

    mine = PythonTechnique("spoil", spoil, curve=spoil_curve)
    image = moit.composite(f, mine)
    np.testing.assert_array_equal(f.depth, before)
    equal = moit.composite(f, PythonTechnique("equal", lambda f: np.ones(len(f))))
    np.testing.assert_array_equal(image, equal)
    assert (moit.transmittance(f, mine, [2.0, 3.0]) == 1).all()


class Foreign:
    """An array of another library, which has DLPack and a namespace, and nothing of NumPy's."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()

    def __array_namespace__(self, api_version=None):
        return np


class Elsewhere(Foreign):
    def __dlpack_device__(self):
        return 2, 0


class Held:
    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return self.array


GIVEN = {
    "foreign": Foreign,
    "__array__": Held,
    "list": list,
    "tuple": tuple,
    "memoryview": memoryview,
    "float32": lambda T: T.astype(np.float32),
    "float16": lambda T: T.astype(np.float16),
    "big-endian": lambda T: T.astype(">f8"),
    "strided": lambda T: np.repeat(T, 2)[::2],
    "read-only": lambda T: np.broadcast_to(T, T.shape),
    "longdouble": lambda T: T.astype(np.longdouble),
}


@pytest.mark.parametrize("kind", GIVEN)
def test_results_may_be_of_any_library(kind):
    f = PICTURES["surfaces"]
    T = np.where(np.arange(len(f)) % 2, 0.5, 0.25)
    mine = PythonTechnique("mine", lambda f: GIVEN[kind](T))
    np.testing.assert_array_equal(moit.transmittance(f, mine), T)


def test_states_may_be_of_any_library_and_shape():
    f = PICTURES["surfaces"]
    for gather in (
        lambda f: Foreign(np.arange(len(f.counts))),
        lambda f: np.arange(len(f.counts), dtype=np.float16)[:, None],
        lambda f: np.tile(np.arange(len(f.counts))[:, None, None], (1, 2, 3)),
    ):
        mine = PythonTechnique(
            "mine",
            None,
            gather=gather,
            read=lambda s, z, a: np.reshape(s, (len(z), -1))[:, 0].astype(float) / 1000,
        )
        pixel = np.repeat(np.arange(len(f.counts)), f.counts)
        np.testing.assert_allclose(moit.transmittance(f, mine), pixel / 1000, atol=1e-12)


def test_large_pictures_are_asked_some_rows_at_a_time(monkeypatch):
    f = PICTURES["coloured"]
    fog = Fog()
    mine = PythonTechnique(
        "mine",
        exact,
        curve=exact_curve,
        total=lambda f: exact_curve(f, [np.inf])[:, 0],
        composite=lambda f, behind: np.concatenate([behind, behind[:, :1]], axis=1),
        bounds=lambda f, z: (exact(f),) * 2 if z is None else (exact_curve(f, z),) * 2,
    )
    ways = [
        lambda: moit.composite(f, mine, background=np.arange(189.0).reshape(7, 9, 3)),
        lambda: moit.composite(f, EXACT),
        lambda: moit.transmittance(f, mine),
        lambda: moit.transmittance(f, mine, [2.0, 4.0]),
        lambda: moit.transmittance(f, fog, [2.0, 4.0]),
        lambda: moit.total_transmittance(f, mine),
        lambda: np.stack(moit.bounds(f, mine)),
        lambda: np.stack(moit.bounds(f, mine, [2.0, 4.0])),
    ]
    whole = [way() for way in ways]
    shapes = []
    for most in (1, 25, 100):
        monkeypatch.setattr(questions, "MOST_FRAGMENTS", most)
        monkeypatch.setattr(questions, "MOST_NUMBERS", most)
        for way, before in zip(ways, whole, strict=True):
            np.testing.assert_allclose(way(), before, rtol=0, atol=1e-13)
    look = PythonTechnique("look", lambda f: shapes.append((f.shape, f.origin)) or exact(f))
    monkeypatch.setattr(questions, "MOST_FRAGMENTS", 1)
    moit.transmittance(f, look)
    assert shapes == [((1, 9), (y, 0)) for y in range(7)]
    shapes.clear()
    monkeypatch.setattr(questions, "MOST_FRAGMENTS", 100)
    moit.transmittance(f, look)
    assert 1 < len(shapes) < 7


class Neighbours(PythonTechnique):
    local = False

    def transmittance(self, f):
        return np.full(len(f), 1 / (1 + len(f.counts)))


def test_what_looks_at_neighbours_sees_the_whole(monkeypatch):
    f = PICTURES["surfaces"]
    mine = Neighbours("neighbours")
    whole = moit.transmittance(f, mine)
    monkeypatch.setattr(questions, "MOST_FRAGMENTS", 1)
    np.testing.assert_array_equal(moit.transmittance(f, mine), whole)
    found = check(mine)
    assert found.ok
    assert found["chunks"].ok is None
    assert found["chunks"].worst > 0


def test_shadow_maps_say_why_they_do_not_take_it():
    for one, told in ((EXACT, "none of the core's"), (Neighbours(), "but at fragments")):
        with pytest.raises(ValueError, match=told):
            moit.ShadowMap("cloud-with-disk", one, light=(0, -1, 0))


# ---- What does not fit -------------------------------------------------------------------------

BAD = {
    "short": (lambda f: f.depth[:3], r"expected shape \(\d+,\), got \(3,\)"),
    "column": (lambda f: f.depth[:, None], r"got \(\d+, 1\)"),
    "number": (lambda f: 0.5, r"got \(\)"),
    "nan": (lambda f: np.full(len(f), np.nan), r"\[0\]: found nan; needed a finite"),
    "infinite": (lambda f: np.full(len(f), np.inf), r"\[0\]: found inf"),
    "too large": (lambda f: np.full(len(f), 1e300), "needed a finite float32"),
    "complex": (lambda f: np.ones(len(f), complex), "real numbers, got complex128"),
    "bool": (lambda f: f.depth > 0, "real numbers, got bool"),
    "text": (lambda f: "half", "real numbers, got <U4"),
    "nothing": (lambda f: None, "NoneType"),
    "ragged": (lambda f: [[1], [2, 3]], "expected an array, got list"),
    "masked": (lambda f: np.ma.masked_less(f.depth, 5), "masked"),
    "elsewhere": (lambda f: Elsewhere(f.depth), "another device"),
    "raises": (lambda f: 1 / 0, "raised ZeroDivisionError: division by zero"),
    "silent": (lambda f: (_ for _ in ()).throw(KeyError()), "raised KeyError"),
    "argument": (lambda: 1, "raised TypeError"),
}


@pytest.mark.parametrize("what", BAD)
def test_what_a_function_does_wrong_is_told_by_technique_and_function(what):
    function, told = BAD[what]
    f = PICTURES["single"]
    with pytest.raises(moit.TechniqueError, match=f"mine: transmittance: .*{told}") as caught:
        moit.composite(f, PythonTechnique("mine", function))
    assert isinstance(caught.value, moit.MoitError)
    assert isinstance(caught.value, ValueError)
    if "raised" in told:
        assert caught.value.__cause__ is not None
    pickle.loads(pickle.dumps(caught.value))  # it comes back from other processes


def wrong(*_):
    return np.zeros(2)


@pytest.mark.parametrize(
    ("called", "ask"),
    [
        ("curve", lambda f, t: moit.transmittance(f, t, [2.0])),
        ("total", lambda f, t: moit.total_transmittance(f, t)),
        ("composite", lambda f, t: moit.composite(f, t)),
        ("bounds", lambda f, t: moit.bounds(f, t)),
    ],
)
def test_every_function_is_told_by_its_name(called, ask):
    f = PICTURES["single"]
    with pytest.raises(moit.TechniqueError, match=f"mine: {called}: "):
        ask(f, PythonTechnique("mine", exact, **{called: wrong}))
    for gather, read, name in ((wrong, halves, "gather"), (lambda f: f.counts, wrong, "read")):
        with pytest.raises(moit.TechniqueError, match=f"mine: {name}: "):
            moit.transmittance(f, PythonTechnique("mine", None, gather=gather, read=read))


def test_ctrl_c_and_lack_of_memory_are_no_errors_of_techniques():
    for error in (KeyboardInterrupt, MemoryError):

        def interrupted(f, error=error):
            raise error

        with pytest.raises(error):
            moit.transmittance(PICTURES["one"], PythonTechnique("mine", interrupted))


def test_a_curve_that_is_not_there_is_refused():
    with pytest.raises(TypeError, match="mine has no transmittance but at fragments"):
        moit.transmittance(PICTURES["one"], PythonTechnique("mine", exact), [1.0])


def test_without_colour_there_is_no_picture_but_there_are_curves():
    f = some_fragments(color=False)
    assert moit.transmittance(f, EXACT).shape == (len(f),)
    with pytest.raises(moit.FragmentsError, match="color"):
        moit.composite(f, EXACT)


def test_a_gpu_is_refused():
    below = types.SimpleNamespace(proves=False)
    with pytest.raises(moit.GpuError, match="exact is Python, on the CPU only"):
        questions.PythonEngine(below).question(PICTURES["one"], EXACT, cull_opaque=True, threads=1)


@pytest.mark.parametrize(
    ("arguments", "error", "told"),
    [
        ((3, exact), TypeError, "name"),
        (("", exact), ValueError, "name"),
        (("two\nlines", exact), ValueError, "name"),
        (("mine", None), TypeError, "transmittance"),
        (("mine", 3), TypeError, "transmittance"),
        (("mine", "exact"), TypeError, "transmittance"),
        (("mine", exact, {"curve": 1}), TypeError, "curve"),
        (("mine", exact, {"total": []}), TypeError, "total"),
        (("mine", None, {"gather": halves}), TypeError, "read"),
        (("mine", None, {"read": halves}), TypeError, "gather"),
        (("mine", exact, {"bits_per_pixel": "8"}), TypeError, "bits_per_pixel"),
        (("mine", exact, {"bits_per_pixel": -1}), ValueError, "bits_per_pixel"),
        (("mine", exact, {"bits_per_pixel": np.nan}), ValueError, "bits_per_pixel"),
        (("mine", exact, {"bits_per_pixel": True}), TypeError, "bits_per_pixel"),
        (("mine", exact, {"geometry_passes": 1.5}), TypeError, "geometry_passes"),
        (("mine", exact, {"normalize": 1}), TypeError, "normalize"),
        (("mine", exact, {"order_independent": None}), TypeError, "order_independent"),
        (("mine", exact, {"other": 1}), TypeError, "other"),
        ((), ValueError, "name"),
    ],
)
def test_bad_arguments_are_named(arguments, error, told):
    options = arguments[2] if len(arguments) > 2 else {}
    with pytest.raises(error, match=told):
        PythonTechnique(*arguments[:2], **options)


# ---- A technique like others ---------------------------------------------------------------------


def test_its_facts_are_what_it_is_given():
    mine = PythonTechnique(
        "mine", exact, bits_per_pixel=48, order_independent=False, geometry_passes=1
    )
    assert (mine.name, str(mine), mine.base_name) == ("mine", "mine", "mine")
    assert (mine.bits_per_pixel, mine.geometry_passes, mine.order_independent) == (48, 1, False)
    assert (mine.has_curve, mine.exact_up_to, mine.normalize) == (False, 0, True)
    assert repr(mine) == "PythonTechnique('mine')"
    usual = PythonTechnique("mine", exact)
    assert (usual.bits_per_pixel, usual.geometry_passes, usual.order_independent) == (None, 2, True)
    assert isinstance(mine, moit.Technique)
    assert moit.technique(mine) is mine
    assert EXACT.has_curve


def test_it_does_not_change_and_is_equal_to_its_like():
    mine, same = (PythonTechnique("mine", exact, bits_per_pixel=3) for _ in range(2))
    assert mine == same
    assert hash(mine) == hash(same)
    assert mine != PythonTechnique("mine", halves, bits_per_pixel=3)
    assert mine != PythonTechnique("mine", exact)
    assert pickle.loads(pickle.dumps(mine)) == mine
    for change in (lambda: setattr(mine, "name", "other"), lambda: delattr(mine, "name")):
        with pytest.raises(dataclasses.FrozenInstanceError):
            change()


def test_a_base_of_frozen_dataclasses_with_options():
    fog = Fog(2.0)
    assert (fog.density, fog.name, str(fog)) == (2.0, "fog", "fog(density=2.0)")
    assert (fog.bits_per_pixel, fog.has_curve) == (64, True)
    assert str(Fog()) == "fog"
    assert dataclasses.replace(fog, steps=3) == Fog(2.0, 3) != fog
    assert len({fog, Fog(2.0), Fog()}) == 2
    assert pickle.loads(pickle.dumps(fog)) == fog
    with pytest.raises(dataclasses.FrozenInstanceError):
        fog.density = 1.0
    f = PICTURES["surfaces"]
    assert (moit.transmittance(f, Fog(2.0)) <= moit.transmittance(f, Fog(1.0))).all()


def test_subclasses_may_say_what_they_are_in_any_way():
    @dataclasses.dataclass(frozen=True)
    class TwoLobes(PythonTechnique):
        count: int = 2
        normalize: bool = False

        @property
        def bits_per_pixel(self):
            return 16 * self.count

        def transmittance(self, f):
            return halves(f)

    assert TwoLobes(3).bits_per_pixel == 48
    assert str(TwoLobes(3)) == "two-lobes(count=3)"
    assert not TwoLobes().normalize
    assert TwoLobes(normalize=True).normalize

    @dataclasses.dataclass(frozen=True)
    class Named(PythonTechnique):
        name: str = "named"
        geometry_passes = 1
        transmittance = staticmethod(halves)

    assert (str(Named()), str(Named("other")), Named().geometry_passes) == ("named", "other", 1)

    class Plain(PythonTechnique):
        bits_per_pixel = 5

        def __init__(self, scale):
            object.__setattr__(self, "scale", scale)
            super().__init__("plain", self.scaled)

        def scaled(self, f):
            return self.scale * halves(f)

    class Further(Plain):
        pass

    assert (Plain(0.5).bits_per_pixel, str(Plain(0.5)), str(Further(1))) == (5, "plain", "plain")
    f = PICTURES["surfaces"]
    assert (moit.transmittance(f, Plain(0.5)) == 0.25).all()
    assert (moit.transmittance(f, Named()) == 0.5).all()

    with pytest.raises(TypeError, match="transmittance"):

        @dataclasses.dataclass(frozen=True)
        class Nothing(PythonTechnique):
            pass

        Nothing()
    with pytest.raises(TypeError, match="engine"):

        class Mine(PythonTechnique):
            engine = "core"


def test_questions_take_it_as_they_take_others(tmp_path):
    f = some_fragments(height=16, width=16)
    answer = moit.recommend(
        f, max_error=1, metric="mse", by="bits", techniques=[Fog(), "sorted"], progress=False
    )
    assert answer.technique == Fog()
    report = moit.compare({"a": f}, [EXACT, Fog(), "power4"], repeat=1, progress=False)
    rows = {row.technique: row for row in report.rows}
    assert rows["exact"].mse < 1e-12
    assert rows["exact"].T_max < 1e-6
    assert rows["fog"].bits_per_pixel == 64
    assert "times are of Python" in rows["fog"].note
    assert rows["power4"].note == ""
    assert all(result.curves for result in report.results)
    report.to_html(tmp_path / "a.html")
    report.to_csv(tmp_path / "a.csv")
    report.to_json(tmp_path / "a.json")
    assert "fog" in str(report)
    assert {"fog", "power4"} >= {row.technique for row in report.pareto("mse", by="bits")[:1]}
    glass = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    image = moit.render(glass, EXACT, (9, 8))
    np.testing.assert_allclose(image, moit.render(glass, "sorted", (9, 8)), atol=1e-6)
    rows = moit.stability([EXACT, Fog()], families=["order", "opaque"], rays=4, progress=False).rows
    assert {row.technique for row in rows} == {"exact", "fog"}
    assert all(row.T_max is not None for row in rows)


def test_its_curve_is_drawn():
    pytest.importorskip("matplotlib").use("Agg")
    ax = moit.plot.curves(PICTURES["surfaces"], [EXACT, Fog(), "power4"])
    assert len(ax.lines) == 4


def test_two_of_one_name_are_two():
    both = [PythonTechnique("mine", exact), PythonTechnique("mine", halves)]
    report = moit.compare(some_fragments(), both, metrics="mse", repeat=1, progress=False)
    assert [row.technique for row in report.rows] == ["mine", "mine (2)"]
    assert report.rows[0].mse < 1e-12 < report.rows[1].mse
    rows = moit.stability(both, families="order", precisions="float64", rays=4, progress=False).rows
    first, second = rows[: len(rows) // 2], rows[len(rows) // 2 :]
    assert max(row.T_max for row in first) < 1e-12 < max(row.T_max for row in second)
    assert max(row.own_max for row in rows) < 1e-12


def test_other_techniques_do_not_take_it_where_they_cannot():
    with pytest.raises(ValueError, match="techniques"):
        moit.PerPixel(techniques=(EXACT,))
    with pytest.raises((TypeError, ValueError), match="exact"):
        moit.moments.gather(PICTURES["one"], EXACT)


def test_a_function_that_fails_is_a_row_with_a_note():
    mine = PythonTechnique("mine", BAD["raises"][0])
    (row,) = moit.compare(some_fragments(), [mine], repeat=1, progress=False).rows
    assert row.seconds is None
    assert row.note.startswith("TechniqueError: mine: transmittance: raised ZeroDivisionError")


def test_on_a_gpu_pictures_of_triangles_are_composited_by_it_and_arrays_are_refused():
    device()  # skips where there is none
    glass = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    with pytest.warns(RuntimeWarning, match="exact is composited on the CPU"):
        image = moit.render(glass, EXACT, (9, 8), device="gpu", exact=True)
    np.testing.assert_allclose(image, moit.render(glass, "sorted", (9, 8)), atol=1e-6)
    chosen = moit.render(glass, moit.PerPixel(), (9, 8), device="gpu", exact=True, report=True)
    assert (chosen.device, chosen.way) == ("gpu", "arrays")
    np.testing.assert_allclose(chosen.image, image, atol=1e-6)
    with pytest.raises(moit.GpuError, match="exact is Python"):
        moit.composite(PICTURES["single"], EXACT, device="gpu", exact=True)
    report = moit.compare(
        some_fragments(), [EXACT], devices="gpu", metrics="mse", repeat=1, progress=False
    )
    assert "exact is Python" in report.rows[0].note


# ---- The example of the documentation -----------------------------------------------------------


@pytest.fixture(scope="module")
def example():
    path = Path(__file__).parents[1] / "docs" / "own_technique.py"
    spec = importlib.util.spec_from_file_location("own_technique", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["own_technique"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["own_technique"]


def test_the_example_keeps_its_promises(example):
    found = check(example.MeanPlace())
    assert found.ok, found
    assert check(example.MeanPlace(16), tolerance=1e-2).ok
    assert (str(example.MeanPlace(16)), example.MeanPlace(16).bits_per_pixel) == (
        "mean-place(bits=16)",
        32,
    )


def test_a_file_of_glsl_is_the_same_technique(example):
    device()  # skips where there is none
    for f in (some_fragments(), PICTURES["opaque"], PICTURES["empty"], PICTURES["a window"]):
        in_glsl = moit.transmittance(f, example.MeanPlacePass())
        off = np.abs(in_glsl - moit.transmittance(f, example.MeanPlace()))
        # at the near end a power of next to 0 makes much of what floats round
        assert off[f.depth > 1.0001 * f.depth_range[0]].max(initial=0) < 1e-5
    assert np.ptp(in_glsl) > 0.1
