"""Colours and lines of techniques: one each, legible on light and dark, told apart by all eyes."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

import moit
from moit.catalog.palette import (
    FAMILIES,
    INK,
    LINES,
    Look,
    family_title,
    technique_colours,
    technique_lines,
    technique_looks,
)
from moit.reports.charts import on_page
from moit.reports.pictures import from_srgb

NAMES = [str(one) for one in moit.techniques()]
LOOKS = dict(zip(NAMES, technique_looks(NAMES), strict=True))

# What eyes without one kind of cones see, in linear sRGB. Machado, Oliveira, Fernandes, "A
# Physiologically-based Model for Simulation of Color Vision Deficiency", 2009, severity 1.
EYES = {
    "usual": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}


def linear(colour):
    return from_srgb(np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]))


def luminance(colour):
    return float(linear(colour) @ [0.2126, 0.7152, 0.0722])


def seen(colour, eyes):
    """Oklab (Ottosson, 2020) of what such eyes see: its distances are about as large as they look;
    0.02 is just noticed side by side."""
    rgb = np.clip(np.array(EYES[eyes]) @ linear(colour), 0, None)
    lms = np.cbrt(
        np.array(
            [
                [0.4122214708, 0.5363325363, 0.0514459929],
                [0.2119034982, 0.6806995451, 0.1073969566],
                [0.0883024619, 0.2817188376, 0.6299787005],
            ]
        )
        @ rgb
    )
    return (
        np.array(
            [
                [0.2104542553, 0.7936177850, -0.0040720468],
                [1.9779984951, -2.4285922050, 0.4505937099],
                [0.0259040371, 0.7827717662, -0.8086757660],
            ]
        )
        @ lms
    )


def distance(one, other, eyes):
    return float(np.linalg.norm(seen(one, eyes) - seen(other, eyes)))


def test_the_simulation_is_that_of_eyes_that_confuse_red_and_green():
    """So that the tests below see what they are for."""
    red, green = "#d55e00", "#6b8e23"
    assert distance(red, green, "usual") > 0.15
    assert distance("#b2182b", "#4d4d00", "protanopia") < 0.1
    assert distance(red, green, "deuteranopia") < 0.07
    for eyes in EYES:  # greys stay greys, but for the digits of the matrices
        assert distance("#808080", "#818181", eyes) < 0.01
        assert np.abs(seen("#808080", eyes)[1:]).max() < 1e-3


@pytest.mark.parametrize("eyes", EYES)
def test_all_eyes_tell_techniques_apart_by_colour_or_line(eyes):
    for one, other in itertools.combinations(NAMES, 2):
        a, b = LOOKS[one], LOOKS[other]
        if a.line == b.line:
            least = 0.028 if eyes == "tritanopia" else 0.033  # which hardly anyone has
            assert distance(a.colour, b.colour, eyes) > least, (one, other)


@pytest.mark.parametrize("eyes", EYES)
def test_ideas_differ_by_colour_alone(eyes):
    first = {family.title: None for family in FAMILIES}
    for name in [*NAMES, "my own"]:
        title = family_title(name)
        first[title] = first[title] or technique_colours([name])[0]
    assert None not in first.values()
    for (one, a), (other, b) in itertools.combinations(first.items(), 2):
        assert distance(a, b, eyes) > (0.025 if eyes == "tritanopia" else 0.04), (one, other)


def test_colours_are_legible_on_paper_and_on_the_page_in_light_and_dark():
    """WCAG 2.2, 1.4.11: marks have a contrast of 3 to 1."""
    style = (Path(moit.__file__).parent / "reports" / "page.css").read_text(encoding="utf-8")
    paper, dark = (luminance(one) for one in re.findall(r"--back: (#\w{6})", style))
    assert paper == pytest.approx(1) and dark < 0.01
    for name in [*NAMES, "my own", *(f"my own{place}" for place in range(12))]:
        colour = technique_colours([name])[0]
        assert (paper + 0.05) / (luminance(colour) + 0.05) >= 2.98, name  # of bytes: nearly 3
        # Pages draw what is exact in the colour of their text.
        assert colour == INK or (luminance(colour) + 0.05) / (dark + 0.05) >= 2.98, name
    assert on_page(INK) == "currentColor" and on_page("#123456") == "#123456"


def test_texts_of_pages_are_legible_in_light_and_dark():
    """WCAG 2.2, 1.4.3: 4.5 to 1, also of what is faint, on all that texts stand on."""
    style = (Path(moit.__file__).parent / "reports" / "page.css").read_text(encoding="utf-8")
    found = [re.findall(rf"--{name}: (#\w{{6}})", style) for name in ("text", "faint", "accent")]
    backs = [re.findall(rf"--{name}: (#\w{{6}})", style) for name in ("back", "panel", "mark")]
    for mode in (0, 1):
        for text, back in itertools.product(found, backs):
            low, high = sorted((luminance(text[mode]), luminance(back[mode])))
            assert (high + 0.05) / (low + 0.05) >= 4.5, (text[mode], back[mode])


def test_members_of_an_idea_differ_in_lightness_and_line():
    three = [LOOKS[name] for name in ("power4", "power6", "power8")]
    assert len({luminance(look.colour) for look in three}) == 3
    assert [look.line for look in three] == ["solid", "dashed", "dotted"]
    hues = [np.arctan2(*seen(look.colour, "usual")[:0:-1]) for look in three]
    assert np.ptp(hues) < 0.15


def test_looks_are_those_of_all_pictures_of_the_documentation():
    expected = {
        "sorted": Look("#000000", "solid"),
        "unsorted": Look("#666666", "solid"),
        "wboit": Look("#ac5b00", "dashdot"),
        "moment-transparency": Look("#b96b84", "dashdot"),
        "power4": Look("#5375e2", "solid"),
        "power6": Look("#698efe", "dashed"),
        "power4-16": Look("#5375e2", "dashdot"),
        "trig3": Look("#e25d59", "dashdot"),
        "mlab4": Look("#4e8a59", "dashed"),
        "fourier7": Look("#2e87a0", "dashed"),
        "stochastic8": Look("#566a14", "dashed"),
        "my own": Look("#9552b4", "dotted"),
    }
    assert dict(zip(expected, technique_looks(list(expected)), strict=True)) == expected


def test_a_technique_has_the_same_look_in_every_picture():
    alone = {name: technique_looks([name])[0] for name in NAMES}
    assert alone == LOOKS and len(set(alone.values())) == len(NAMES)
    assert technique_looks(["sorted", "trig3", "power6"]) == [
        alone[name] for name in ("sorted", "trig3", "power6")
    ]
    assert technique_looks(["power6", "power6(bias=0.0)"])[0] == alone["power6"]
    assert technique_looks(["power6(bias=0.0)", "power8", "power6"])[1:] == [
        *(alone["power8"], alone["power6"])
    ]
    assert len(set(technique_looks(["power6", *(f"power6(bias={i})" for i in range(11))]))) == 12
    assert technique_colours(["power4 (2)", "my own", "", "power6 (2)"])  # any text
    assert set(technique_lines(NAMES)) == set(LINES)
