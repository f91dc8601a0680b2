"""moit.check_technique: promises that are kept and such that are not."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from own_techniques import EXACT, Fog, PythonTechnique, check, exact

import moit


@pytest.mark.parametrize("one", [EXACT, Fog(), "sorted", "power4", "power6-16", "mlab4"], ids=str)
def test_good_techniques_keep_their_promises(one):
    found = check(one)
    assert found.ok, found
    assert found["self-shadowing"].ok is None


def arrival(f):
    return 1 / (1 + np.arange(len(f)) - np.repeat(f.offsets[:-1], f.counts))


def neighbours(f):
    return np.full(len(f), 1 / (1 + len(f)))


def fragile(f):
    with np.errstate(all="ignore"):
        return np.exp(np.log1p(-f.alpha)) * (1 - f.alpha) / (1 - f.alpha)


def rising(f, depths):
    return np.tile(np.linspace(0, 1, len(depths)), (len(f.counts), 1)) ** (f.counts > 0)[:, None]


def leaking(f):
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    through = np.ones(len(f.counts))
    np.multiply.at(through, pixel, 1 - f.alpha)
    return np.where(f.counts > 0, through, 0.5)


FAULTS = {
    "order": PythonTechnique("arrival", arrival),
    "chunks": PythonTechnique("neighbours", neighbours),
    "range": PythonTechnique("large", lambda f: 1 + f.alpha),
    "finite": PythonTechnique("fragile", fragile),
    "monotone": PythonTechnique("rising", exact, curve=rising),
    "empty": PythonTechnique("leaks", exact, total=leaking),
}


@pytest.mark.parametrize("what", FAULTS)
def test_a_broken_promise_is_found(what):
    found = check(FAULTS[what])
    assert not found.ok
    broken = [row.name for row in found.rows if row.ok is False]
    assert broken == [what]
    assert f"not kept: {what}" in str(found)


def test_what_is_not_promised_is_told_only():
    found = check(PythonTechnique("arrival", arrival, order_independent=False))
    assert found.ok
    assert found["order"].ok is None
    assert found["order"].worst > 0.1


def test_rounding_after_every_fragment_is_allowed_where_one_says_so():
    def gather(f):
        return moit.storage.added(f, -np.log1p(-np.minimum(f.alpha, 0.99)), "half")

    mine = PythonTechnique("mine", None, gather=gather, read=lambda s, z, a: np.exp(-s * z / 8))
    assert check(mine)["order"].ok is False
    assert check(mine, tolerance=1e-2)["order"].ok


def test_what_fails_is_a_row_that_says_why():
    found = check(PythonTechnique("fails", lambda f: 1 // 0))
    assert not found.ok
    assert "ZeroDivisionError" in found["order"].note
    assert "ZeroDivisionError" in found["finite"].note


def test_self_shadowing_is_what_a_fragments_own_alpha_changes():
    assert check("sorted")["self-shadowing"].worst == 0
    assert check("power4")["self-shadowing"].worst > 0.1
    mine = PythonTechnique("mine", lambda f: 1 - f.alpha)
    assert check(mine)["self-shadowing"].worst == pytest.approx(0.9)


def test_brightness_is_what_weights_sum_to_beyond_what_is_covered():
    assert check("power4")["brightness"].ok
    raw = check("power4(normalize=False)")["brightness"]
    assert raw.ok is None and raw.worst > 0.01


def test_a_check_shows_itself():
    found = check("power4")
    assert str(found) == repr(found)
    assert str(found).startswith("power4: all promises are kept\ncheck ")
    html = found._repr_html_()
    assert html.count("<tr>") == len(found.rows) + 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.technique = "other"
    with pytest.raises(KeyError, match="there are order"):
        found["orders"]
    shown = check(PythonTechnique("<b>", exact))._repr_html_()
    assert "&lt;b&gt;" in shown
    assert "<b><b>" not in shown


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"rays": 0}, ValueError),
        ({"rays": 1.5}, TypeError),
        ({"seed": -1}, ValueError),
        ({"tolerance": -1}, ValueError),
        ({"tolerance": "1"}, TypeError),
    ],
)
def test_bad_arguments_of_the_check_are_named(options, error):
    with pytest.raises(error, match=next(iter(options))):
        moit.check_technique("sorted", progress=False, **options)
    with pytest.raises(ValueError, match="did you mean"):
        moit.check_technique("power44444")


def test_the_lines_of_its_page_run(capsys):
    pytest.importorskip("matplotlib").use("Agg")
    text = (Path(__file__).parents[1] / "docs" / "own_technique.md").read_text(encoding="utf-8")
    lines = text.partition("```python\n")[2].partition("```")[0]
    held = {"__name__": "page", "dataclasses": dataclasses, "np": np, "moit": moit}
    exec(lines, held | {"f": moit.scenes.load("hair", (48, 36))})
    told = capsys.readouterr().out
    assert "inverse-depth" in told
    assert "fog: all promises are kept" in told


@pytest.mark.parametrize("value", [-0.25, 1.25])
def test_transmittance_outside_its_range_is_told_on_both_sides(value):
    def outside(fragments):
        return np.full(len(fragments), value)

    one = moit.PythonTechnique("outside", outside, bits_per_pixel=32)
    rows = {row.name: row for row in moit.check_technique(one, progress=False).rows}
    assert rows["range"].worst == pytest.approx(0.25) and rows["range"].ok is False


def test_pictures_that_are_tried_have_opaque_surfaces():
    from moit.numerics.checking import _Tried

    alpha = _Tried(moit.technique("power4"), 1e-4, 10, 0).picture().alpha
    assert 0 < np.count_nonzero(alpha == 1) < len(alpha) / 8
