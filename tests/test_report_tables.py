"""A report as tables that papers and notebooks take: Markdown, LaTeX, pandas, xarray."""

import math
import re
import sys

import pytest

import moit
from moit.comparing.report import Report
from moit.comparing.rows import Result, Row

NAMES = ("sorted", "wboit-eq7", "power4", "power4(bias=0.0)")


def row(scene, technique, **fields):
    empty = dict.fromkeys(Report([], {}).columns)
    return Row({**empty, "scene": scene, "device": "cpu", "technique": technique, **fields})


def report(scenes=("a_b", "c|d")):
    rows = []
    for k, scene in enumerate(scenes):
        for i, name in enumerate(NAMES):
            error = 1e-7 if i == 0 else (k + 1) * 0.01234567 * i
            numbers = {"seconds": 0.001 * (i + 1), "mse": error, "psnr": 50.123456 - i}
            bits = None if i == 0 else 8.0 * i
            rows.append(row(scene, name, bits_per_pixel=bits, note="", **numbers))
    return Report([Result(one) for one in rows], {}, ("mse", "psnr", "flip"), "sorted", "here")


def test_latex_has_the_rules_of_booktabs_units_and_the_best_in_bold(tmp_path):
    text = report().to_latex(tmp_path / "table.tex")
    assert (tmp_path / "table.tex").read_text() == text
    lines = text.splitlines()
    assert lines[0] == r"\begin{tabular}{llrrrr}"
    assert lines[1:4] == [
        r"\toprule",
        r"Scene & Technique & Memory [bit/px] & Time [ms] & MSE & PSNR [dB] \\",
        r"\midrule",
    ]
    assert lines[-2:] == [r"\bottomrule", r"\end{tabular}"]
    assert lines[8] == r"\midrule" and text.count(r"\midrule") == 2  # between the two scenes
    body = [line for line in lines[4:-2] if "&" in line]
    assert body[0] == (
        r"a\_b & sorted & -- & \textbf{1} & $1.00\times10^{-7}$ & 50.1 \\"
    )  # the reference's errors are not the best
    assert body[1] == r"a\_b & wboit-eq7 & 8 & 2 & \textbf{0.0123} & \textbf{49.1} \\"
    assert "FLIP" not in text  # nobody measured it
    for line in body:
        assert line.count("&") == 5 and not re.search(r"(?<!\\)[_%#]", line)


def test_a_best_power_of_ten_is_bold_too():
    rows = [row("a", name, mse=error) for name, error in (("x", 2e-9), ("y", 1.0))]
    found = Report([Result(one) for one in rows], {}, ("mse",), "sorted", "")
    assert r"x & $\mathbf{2.00\times10^{-9}}$ \\" in found.to_latex()
    assert "| x | **2.00e-9** |" in found.to_markdown()


@pytest.mark.parametrize(
    ("name", "escaped"),
    [
        ("a&b", r"a\&b"),
        ("50 %", r"50 \%"),
        ("x_y", r"x\_y"),
        ("$x$", r"\$x\$"),
        ("#1", r"\#1"),
        ("{}", r"\{\}"),
        ("a\\b", r"a\textbackslash{}b"),
        ("~", r"\textasciitilde{}"),
        ("^2", r"\textasciicircum{}2"),
        ("-", "--"),
    ],
)
def test_what_latex_would_take_for_its_own_is_escaped(name, escaped):
    found = Report([Result(row("s", name, mse=0.5))], {}, ("mse",), "sorted", "")
    assert found.to_latex(columns=["technique"]).splitlines()[4] == rf"{escaped} \\"


def test_markdown_has_the_best_in_bold_and_bars_escaped(tmp_path):
    text = report().to_markdown(tmp_path / "table.md")
    assert (tmp_path / "table.md").read_text() == text + "\n"
    lines = text.splitlines()
    assert len(lines) == 2 + 8 and all(re.sub(r"\\\|", "", line).count("|") == 7 for line in lines)
    assert lines[0] == "| Scene | Technique | Memory [bit/px] | Time [ms] | MSE | PSNR [dB] |"
    assert lines[3] == "| a_b | wboit-eq7 | 8 | 2 | **0.0123** | **49.1** |"
    assert lines[6].startswith(r"| c\|d | sorted | - | **1** |")


def test_columns_and_digits_are_as_asked():
    found = report(["one"])
    assert found.to_markdown().splitlines()[0].startswith("| Technique |")  # there is one scene
    text = found.to_markdown(columns=["technique", "mse", "note"], digits=2)
    assert text.splitlines()[0] == "| Technique | MSE | Note |"
    assert text.splitlines()[3] == "| wboit-eq7 | **0.012** |  |"
    with pytest.raises(ValueError, match="columns: expected some of scene, "):
        found.to_latex(columns=["speed"])
    for digits in (0, 5, "3", 2.0):
        with pytest.raises(ValueError, match="digits: expected 1, 2, 3, 4"):
            found.to_markdown(digits=digits)


def test_an_empty_report_has_a_head():
    found = Report([], {}, ("mse",), "sorted", "")
    assert found.to_markdown().splitlines() == ["| Technique |", "| :-- |"]
    assert r"\bottomrule" in found.to_latex()


def test_pandas_has_the_rows():
    pytest.importorskip("pandas")
    frame = report().to_pandas()
    assert list(frame.columns) == list(report().columns) and len(frame) == 8
    assert frame["mse"].dtype == float and math.isnan(frame["bits_per_pixel"][0])
    one = frame[(frame.scene == "a_b") & (frame.technique == "power4")]
    assert one.mse.item() == 2 * 0.01234567 and one.seconds.item() == 0.003
    assert frame["flip"].isna().all()


def test_xarray_has_scenes_devices_and_techniques():
    pytest.importorskip("xarray")
    data = report().to_xarray()
    assert dict(data.sizes) == {"scene": 2, "device": 1, "technique": 4}
    assert data.mse.sel(scene="c|d", device="cpu", technique="power4").item() == 4 * 0.01234567
    assert math.isnan(data.bits_per_pixel.sel(scene="a_b", technique="sorted").item())
    assert data.attrs == {"machine": "here", "reference": "sorted"}
    half = Report(report().results[:5], {}, ("mse", "psnr", "flip"), "sorted", "here").to_xarray()
    assert math.isnan(half.mse.sel(scene="c|d", technique="power4").item())


@pytest.mark.parametrize("package", ["pandas", "xarray"])
def test_a_missing_package_is_named(package, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ImportError, match=rf"{package}.*pip install 'moit\[tables\]'"):
        getattr(report(), f"to_{package}")()


def test_what_compare_gives_is_a_table():
    f = moit.scenes.load("panes", (16, 12))
    found = moit.compare(f, "wboit,power4", metrics=["mse", "flip"], repeat=1, progress=False)
    assert "wboit" in found.to_markdown() and r"\textbf" in found.to_latex()
