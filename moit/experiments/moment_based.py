"""Muenstermann, Krumpen, Klein, Peters, "Moment-Based Order-Independent Transparency", 2018:
figures 5 to 8 and table 1, pictures of scenes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from moit.experiments.claims import Claim, Less, Near, Of, Rising
from moit.experiments.comparisons import Comparison, Timing
from moit.experiments.description import Experiment, Published
from moit.experiments.moment_based_rays import P4, P6, P8, PAPER, T2, T3, T4, WBOIT
from moit.fragments.fragments import Fragments

SHIP = "ship-like"
CLOUDS = "ship-in-clouds"


def _flip(technique: str, scene: str) -> Of:
    return Of("flip", technique, scene)


FIGURE_5 = Experiment(
    name="mboit-fig5",
    paper=PAPER,
    figure="figures 1 and 5",
    title="a ship in clouds of particles",
    about=(
        "The paper's ship is by Greg Zaal and Chris Kuhn; ours is a generated glass ship with "
        "masts, sails and rigging in 2600 particles. The paper prints no errors: those here are "
        "against compositing in depth order."
    ),
    parts=(
        Comparison(
            "Pictures and errors",
            "",
            (CLOUDS,),
            (
                "unsorted", WBOIT, "adaptive4", "mlab4", "mlab6", P4, "power6-16", P6, T3,
                "power6", "trig3",
            ),
            shown=(WBOIT, "mlab4", "adaptive4", P4, "power6-16", T3),
            front=True,
            columns=("bits_per_pixel", "flip", "ssim", "rmse", "T_mae", "T_p99", "front"),
        ),
    ),
    claims=(
        Claim(
            "Multi-layer alpha blending fails to occlude through the particles.",
            "section 7.1",
            (Less(_flip(P6, CLOUDS), _flip("mlab4", CLOUDS), 0.75),),
        ),
        Claim(
            "Adaptive transparency is worse.",
            "section 7.1",
            (Less(_flip("mlab4", CLOUDS), _flip("adaptive4", CLOUDS)),),
        ),
        Claim(
            "Weighted blended OIT does not convey the occlusion of fog and ship; moments are far "
            "more accurate.",
            "section 7.1",
            tuple(Less(_flip(one, CLOUDS), _flip(WBOIT, CLOUDS), 0.5) for one in (P4, P6, T3)),
        ),
        Claim(
            "Six power moments are closer than four, three trigonometric ones in floats closer "
            "still.",
            "section 7.1",
            (Rising((_flip(T3, CLOUDS), _flip("power6-16", CLOUDS), _flip(P4, CLOUDS))),),
        ),
        Claim(
            "With three trigonometric moments in floats errors vanish almost entirely.",
            "section 7.1",
            (Less(_flip(T3, CLOUDS), 0.02),),
        ),
    ),
)  # fmt: skip

POTS = "teapots"
FIGURE_6 = Experiment(
    name="mboit-fig6",
    paper=PAPER,
    figure="figure 6",
    title="seventeen teapots between curtains",
    about=(
        "A row of seventeen glass pots that runs away from the eye, between transparent curtains. "
        "The paper's stands in Sponza; ours in a hall of columns."
    ),
    parts=(
        Comparison(
            "Pictures and errors",
            "",
            (POTS,),
            (
                "unsorted", WBOIT, "adaptive4", "mlab2", "mlab4", P4, "power6-16", P6, T3,
                "power6", "trig3",
            ),
            shown=(WBOIT, "adaptive4", "mlab4", P4, P6, T3),
            front=True,
            columns=("bits_per_pixel", "flip", "ssim", "rmse", "T_mae", "T_p99", "front"),
        ),
    ),
    claims=(
        Claim(
            "Multi-layer alpha blending performs well but for some artifacts; adaptive "
            "transparency shares them and underestimates transmittance where many pots overlap.",
            "section 7.1",
            (
                Less(_flip("mlab4", POTS), _flip("adaptive4", POTS)),
                Less(_flip("mlab4", POTS), 0.02),
            ),
        ),
        Claim(
            "Weighted blended OIT lets the curtains and the hindmost pots appear too visible.",
            "section 7.1",
            (
                Less(Of("front", WBOIT, POTS), 0.0),
                Less(_flip(P4, POTS), _flip(WBOIT, POTS)),
            ),
        ),
        Claim(
            "Four power moments are plausible; six improve on them.",
            "section 7.1",
            (Less(_flip(P6, POTS), _flip(P4, POTS)), Less(_flip(P4, POTS), 0.05)),
        ),
    ),
)  # fmt: skip


def _pot(f: Fragments) -> NDArray[np.bool_]:
    """Where the red pot is, and leaves with soft edges are not."""
    assert f.color is not None
    red = (f.color[:, 0] > 4 * f.color[:, 1]) & (f.alpha < 1)
    return _any(f, red) & ~_any(f, _soft(f))


def _soft(f: Fragments) -> NDArray[np.bool_]:
    """Fragments of the leaves' edges."""
    assert f.color is not None
    return (f.color[:, 1] > f.color[:, 0]) & (f.alpha > 0.02) & (f.alpha < 0.98)


def _any(f: Fragments, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(H, W): pixels with such a fragment."""
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    return (np.bincount(pixel[mask], minlength=len(f.counts)) > 0).reshape(f.shape)


def _edges(f: Fragments) -> NDArray[np.bool_]:
    """Soft edges of leaves, away from the pot."""
    assert f.color is not None
    red = (f.color[:, 0] > 4 * f.color[:, 1]) & (f.alpha < 1)
    return _any(f, _soft(f)) & ~_any(f, red)


def _edges_and_pot(f: Fragments) -> NDArray[np.bool_]:
    assert f.color is not None
    red = (f.color[:, 0] > 4 * f.color[:, 1]) & (f.alpha < 1)
    return _any(f, _soft(f)) & _any(f, red)


LEAVES = "foliage"
BARE, OWN = (
    "power6(bias='published',normalize=False)",
    "power6(bias='published',exclude_self=True)",
)
FIGURE_7 = Experiment(
    name="mboit-fig7",
    paper=PAPER,
    figure="figure 7",
    title="foliage and a red pot, with and without renormalisation",
    about=(
        "Leaves whose alpha goes from 0 to 1 within a pixel or two, behind and before a red pot. "
        "To the paper's two pictures come what moit adds, a fragment that does not occlude itself, "
        "and hashed alpha, which the paper recommends."
    ),
    parts=(
        Comparison(
            "Pictures and errors",
            "Edges: pixels with a soft edge of a leaf and without the pot; pot: those with the pot "
            "and no such edge; both: with both. `light`: mean error of luminance, below 0 too "
            "dark. Hashed alpha is right on the mean, and noisy in each pixel.",
            (LEAVES,),
            (P6, BARE, OWN, "power6", "power6(exclude_self=True)", WBOIT, "hashed-alpha", "mlab4"),
            columns=(
                "flip", "rmse", "rmse edges", "light edges", "rmse both", "light both", "rmse pot",
            ),
            shown=(P6, BARE, OWN, "hashed-alpha", WBOIT),
            crop=(0.1, 0.25, 0.9, 0.95),
            regions={"edges": _edges, "pot": _pot, "both": _edges_and_pot},
        ),
    ),
    claims=(
        Claim(
            "Without renormalisation the transparent parts of the foliage are too dark.",
            "figure 7",
            (
                Less(Of("light edges", BARE, LEAVES), -0.002),
                Less(Of("light both", BARE, LEAVES), 0.0),
            ),
        ),
        Claim(
            "Renormalisation removes this.",
            "figure 7",
            (Less(Of("rmse edges", P6, LEAVES), Of("rmse edges", BARE, LEAVES), 0.5),),
        ),
        Claim(
            "It propagates part of the error to the pot.",
            "figure 7",
            (Less(Of("rmse edges", P6, LEAVES), Of("rmse both", P6, LEAVES)),),
        ),
        Claim(
            "Hashed alpha testing suits rapidly changing alpha better.",
            "section 7.1",
            (
                Less(
                    Of("rmse edges", "hashed-alpha", LEAVES), Of("rmse edges", P6, LEAVES)
                ),
            ),
        ),
    ),
)  # fmt: skip


def _two(f: Fragments) -> NDArray[np.bool_]:
    """Where two spheres lie before one another."""
    return np.asarray(f.counts.reshape(f.shape) == 4)


def _three(f: Fragments) -> NDArray[np.bool_]:
    return np.asarray(f.counts.reshape(f.shape) == 6)


SPHERES = "spheres"
WORDS = ("power4-16", "power6-16", "trig2-16", "trig3-16", "trig4-16")
FLOATS = (P4, P6, P8, T2, T3, T4)


def _crossing(technique: str, count: int) -> Of:
    return Of(f"rmse {('', '', 'two', 'three')[count]}", technique, SPHERES)


FIGURE_8 = Experiment(
    name="mboit-fig8",
    paper=PAPER,
    figure="figure 8",
    title="three spheres that intersect",
    about=(
        "The depth range is twelve times a sphere's radius, enlarged as in the paper, so that "
        "surfaces are close in it."
    ),
    parts=(
        Comparison(
            "Pictures and errors",
            "Two, three: where that many spheres lie before one another.",
            (SPHERES,),
            (*WORDS, *FLOATS, "trig4", "power8", WBOIT, "mlab2", "mlab4", "adaptive4"),
            columns=("bits_per_pixel", "flip", "rmse two", "rmse three", "T_mae", "T_max"),
            shown=("power6-16", P6, "trig4-16", T4, WBOIT, "mlab2", "adaptive4"),
            crop=(0.2, 0.04, 0.8, 0.96),
            regions={"two": _two, "three": _three},
            background=(0.8, 0.82, 0.85),
        ),
    ),
    claims=(
        Claim(
            "All techniques that store moments in 16 bits fail to draw a sharp line where spheres "
            "intersect.",
            "section 7.1",
            tuple(Less(_crossing(T4, 2), _crossing(one, 2), 0.25) for one in WORDS),
        ),
        Claim(
            "Trigonometric moments improve sharpness.",
            "section 7.1",
            (
                Less(_crossing(T3, 2), _crossing(P6, 2)),
                Less(_crossing(T4, 2), _crossing(P8, 2)),
                Less(_crossing("trig3-16", 2), _crossing("power6-16", 2)),
            ),
        ),
        Claim(
            "With four trigonometric moments in floats the intersection of two spheres is sharp, "
            "that of three is blurred.",
            "section 7.1",
            (
                Less(_crossing(T4, 2), 0.02),
                Less(_crossing(T4, 2), _crossing(T4, 3), 0.25),
            ),
        ),
        Claim(
            "Weighted blended OIT blurs, too.",
            "section 7.1",
            tuple(Less(_crossing(T4, count), _crossing(WBOIT, count), 0.5) for count in (2, 3)),
        ),
        Claim(
            "Two layers, or four nodes of adaptive transparency, give a perfect result.",
            "section 7.1",
            tuple(
                Less(_crossing(one, count), 0.005)
                for one in ("mlab2", "adaptive4")
                for count in (2, 3)
            ),
        ),
    ),
)

# Table 1: memory in bits a pixel; ms of pass 1, of pass 2, and of a frame beyond unsorted blending.
_BITS = {
    "unsorted": 0, "adaptive4": 128, "mlab2": 160, "mlab4": 320, WBOIT: 8,
    "power4-16": 80, P4: 160, "power6-16": 112, P6: 224,
    "trig3-16": 112, T3: 224, "trig4-16": 144, T4: 288,
}  # fmt: skip
_MS = {
    POTS: {
        "unsorted": (0.79, None, 0.0), "adaptive4": (1.6, 0.94, 1.8), "mlab2": (2.0, 0.13, 1.4),
        "mlab4": (3.4, 0.22, 2.8), WBOIT: (0.85, 0.07, 0.10),
        "power4-16": (0.94, 1.0, 1.2), P4: (1.2, 1.0, 1.5),
        "power6-16": (1.2, 1.1, 1.6), P6: (1.6, 1.2, 2.1),
        "trig3-16": (1.2, 1.7, 2.2), T3: (1.6, 1.7, 2.6),
        "trig4-16": (1.3, 2.4, 3.0), T4: (1.9, 2.4, 3.6),
    },
    SHIP: {
        "unsorted": (1.4, None, 0.0), "adaptive4": (3.0, 1.8, 3.3), "mlab2": (3.9, 0.11, 2.6),
        "mlab4": (6.6, 0.20, 5.3), WBOIT: (1.6, 0.06, 0.16),
        "power4-16": (2.0, 1.8, 2.3), P4: (2.3, 1.8, 2.7),
        "power6-16": (2.3, 2.2, 3.1), P6: (3.1, 2.2, 3.8),
        "trig3-16": (2.3, 3.2, 4.2), T3: (3.1, 3.2, 4.9),
        "trig4-16": (2.9, 4.5, 5.7), T4: (3.6, 4.8, 6.8),
    },
}  # fmt: skip
_FRAME: dict[tuple[str | None, str], float] = {  # milliseconds of a frame, beyond unsorted blending
    (scene, name): times[2] for scene, ms in _MS.items() for name, times in ms.items()
}
LISTED = tuple(_BITS)
MOMENTS = ("power4-16", P4, "power6-16", P6, "trig3-16", T3, "trig4-16", T4)


def _diff(technique: str, scene: str) -> Of:
    return Of("diff_ms", technique, scene)


TABLE_1 = Experiment(
    name="mboit-table1",
    paper=PAPER,
    figure="table 1",
    title="run times and memory",
    about=(
        "Milliseconds for a picture beyond those of blending without sorting, as the paper has "
        "them, beside the paper's, which are of its own scenes on an NVIDIA GeForce GTX 1080 Ti "
        "and an Intel Core i7-8700K at 1920 x 1080. Ratios compare: 1 is four power moments in 160 "
        "bits. On a processor the fragments are there already, as arrays, and pass 1 is "
        "`moit.moments.gather`; on a GPU triangles are "
        "drawn, as in the paper. Errors are ours: the paper prints none."
    ),
    parts=(
        Comparison(
            "Times, memory and errors",
            "",
            (POTS, SHIP),
            LISTED,
            shown=(),
            columns=(
                "bits_per_pixel", "first_ms", "second_ms", "diff_ms", "ratio", "flip", "rmse",
                "T_mae",
            ),
            timing=Timing(P4, "diff_ms"),
            published=Published(
                "MBOIT, table 1",
                "GTX 1080 Ti, 2018",
                {
                    "paper_bits_per_pixel": {(None, name): bits for name, bits in _BITS.items()},
                    "paper_diff_ms": _FRAME,
                },
            ),
        ),
    ),
    claims=(
        Claim(
            "Additional memory is as listed.",
            "table 1",
            tuple(
                Near(Of("bits_per_pixel", name, POTS), float(bits), 0.0)
                for name, bits in _BITS.items()
            ),
        ),
        Claim(
            "Weighted blended OIT is significantly faster than all moments but much less accurate.",
            "section 7.3",
            tuple(
                test
                for scene in (POTS, SHIP)
                for test in (
                    Less(_diff(WBOIT, scene), _diff("power4-16", scene), 0.5),
                    Less(_flip(P4, scene), _flip(WBOIT, scene), 0.5),
                )
            ),
        ),
        Claim(
            "Adaptive transparency with four nodes takes slightly more time than six power moments "
            "in 112 bits.",
            "section 7.3",
            tuple(Less(_diff("power6-16", s), _diff("adaptive4", s)) for s in (POTS, SHIP)),
        ),
        Claim(
            "Four layers take slightly longer than three trigonometric moments in 224 bits.",
            "section 7.3",
            tuple(Less(_diff(T3, scene), _diff("mlab4", scene)) for scene in (POTS, SHIP)),
        ),
        Claim(
            "Two layers lie between four power moments in 80 and in 160 bits.",
            "section 7.3",
            tuple(
                test
                for scene in (POTS, SHIP)
                for test in (
                    Less(_diff("power4-16", scene), _diff("mlab2", scene)),
                    Less(_diff("mlab2", scene), _diff(P4, scene)),
                )
            ),
        ),
        Claim(
            "In these three cases moments clearly offer the higher quality.",
            "section 7.3",
            tuple(
                Less(_flip(moments, scene), _flip(other, scene))
                for scene in (POTS, SHIP)
                for moments, other in (("power6-16", "adaptive4"), (T3, "mlab4"), (P4, "mlab2"))
            ),
        ),
        Claim(
            "Times of the moments are sorted the way they are listed.",
            "section 7.3",
            tuple(Rising(tuple(_diff(one, scene) for one in MOMENTS)) for scene in (POTS, SHIP)),
        ),
        Claim(
            "Their quality is sorted so, too, but for four trigonometric moments in 144 bits.",
            "section 7.3",
            tuple(
                Rising(tuple(_flip(one, scene) for one in (T4, T3, P6, P4)))
                for scene in (POTS, SHIP)
            ),
        ),
    ),
)  # fmt: skip

EXPERIMENTS = (FIGURE_5, FIGURE_6, FIGURE_7, FIGURE_8, TABLE_1)
