"""MBOIT's figures 3 and 4: ideal cases and the wrapping zone, on single rays and many."""

from __future__ import annotations

import math

import numpy as np

from moit.experiments.claims import Claim, Less, Of, Rising
from moit.experiments.description import Experiment
from moit.experiments.moment_transparency import FAR, NEAR, samples
from moit.experiments.rays import Curves, Ray, Sweep
from moit.fragments.fragments import Fragments

PAPER = "Moment-Based Order-Independent Transparency (Muenstermann et al. 2018)"
# With the paper's bias; ours is less, and sharper.
P4, P6, P8 = (f"power{count}(bias='published')" for count in (4, 6, 8))
T2, T3, T4 = (f"trig{count}(bias='published')" for count in (2, 3, 4))
WBOIT = "wboit-phenomenological"  # the weight that the paper compares with
IDEAL = {2: (P4, T2), 3: (P6, T3), 4: (P8, T4)}  # by the surfaces that they can tell apart

SURFACES = "random surfaces"
RAYS_OF = {
    "2 surfaces": Ray((1.6, 2.4), (0.6, 0.5)),
    "3 surfaces": Ray((1.4, 2.0, 3.0), (0.4, 0.5, 0.6)),
    "4 surfaces": Ray((1.3, 1.7, 2.4, 3.2), (0.3, 0.5, 0.4, 0.6)),
}


def _surfaces(technique: str, count: float) -> Of:
    return Of("T_rmse", technique, SURFACES, count)


def _ours(technique: str) -> str:
    return technique.split("(")[0]


FIGURE_3 = Experiment(
    name="mboit-fig3",
    paper=PAPER,
    figure="figure 3",
    title="ideal cases",
    about=(
        "As many surfaces as moments can tell apart: half as many as power moments, as many as "
        "trigonometric ones. In theory all of these are exact; bias, which rounding needs, blurs "
        "them. Beside the paper's bias stands the one that moit has by default, which the solver "
        "by Gauss nodes allows."
    ),
    parts=(
        Curves(
            "Ideal cases",
            "Float32, overestimation .25.",
            RAYS_OF,
            (P4, T2, P6, T3, P8, T4, *map(_ours, (P4, T2, P6, T3, P8, T4))),
            (NEAR, FAR),
        ),
        Sweep(
            SURFACES,
            "Root mean square error over the depth range; alpha .2 to .8.",
            "surfaces of a ray",
            (1, 2, 3, 4, 5, 6, 8),
            samples,
            (P4, P6, P8, T2, T3, T4, *map(_ours, (P4, P6, P8, T2, T3, T4))),
        ),
    ),
    claims=(
        Claim(
            "In theory the reconstructions are perfect here (with moit's bias they all but are).",
            "figure 3",
            tuple(
                Less(Of("curve_max", _ours(one), f"{count} surfaces"), 0.01)
                for count, pair in IDEAL.items()
                for one in pair
            ),
        ),
        Claim(
            "The bias that compensates for rounding degrades them.",
            "figure 3",
            tuple(
                Less(_surfaces(_ours(one), count), _surfaces(one, count))
                for count, pair in IDEAL.items()
                for one in pair
            ),
        ),
        Claim(
            "For power moments this is a much greater problem than for trigonometric ones.",
            "figure 3",
            tuple(
                Less(_surfaces(trig, count), _surfaces(power, count), 0.5)
                for count, (power, trig) in IDEAL.items()
            ),
        ),
        Claim(
            "Bias diminishes the benefit of eight power moments over six.",
            "section 4.2",
            (
                Less(_surfaces(P6, 4), _surfaces(P8, 4), 2.0),
                Less(_surfaces(_ours(P8), 4), _surfaces(_ours(P6), 4), 0.5),
            ),
        ),
    ),
)

ZONES = {
    "0": "trig3(wrapping_zone=0.0)",
    "pi/100": f"trig3(wrapping_zone={math.pi / 100!r})",
    "pi/10": "trig3",
    "pi/4": f"trig3(wrapping_zone={math.pi / 4!r})",
}
LOW, MIDDLE, HIGH = "trig3(overestimation=0.0)", "trig3", "trig3(overestimation=1.0)"
DISTRIBUTION = Ray(
    (1.15, 1.3, 1.7, 1.8, 2.4, 2.5, 2.7, 3.4, 3.8), (0.3, 0.2, 0.3, 0.4, 0.2, 0.3, 0.2, 0.4, 0.3)
)


def _steepness(f: Fragments, name: str) -> dict[str, float | None]:
    """The greatest change within 1/2000 of the range of each ray's curve: its mean and 99 %."""
    from moit.questions import transmittance

    depth = np.linspace(*f.depth_range, 2001).astype(f.dtype)
    jumps = np.abs(np.diff(transmittance(f, name, depth)[0], axis=1)).max(axis=1)
    exact = transmittance(f, "sorted", depth)[0]
    held = transmittance(f, name, depth)[0]
    return {
        "jump": float(jumps.mean()),
        "jump_p99": float(np.percentile(jumps, 99)),
        "T_rmse": float(np.sqrt(((held - exact) ** 2).mean())),
    }


CONTINUITY = "random rays"


def _jump(zone: str) -> Of:
    return Of("jump", ZONES[zone], CONTINUITY, 8)


FIGURE_4 = Experiment(
    name="mboit-fig4",
    paper=PAPER,
    figure="figure 4",
    title="overestimation and wrapping zone of trigonometric moments",
    about=(
        "Three trigonometric moments of one distribution. Overestimation 0 and 1 give what stands "
        "for a lower and an upper bound of absorbance, but is none. The wrapping zone is the part "
        "of the circle that no depth has: without one curves jump, with a wide one they are smooth "
        "and depths have less of the circle."
    ),
    parts=(
        Curves(
            "Overestimation 0, .25 and 1",
            "",
            {"overestimation": DISTRIBUTION},
            (LOW, MIDDLE, HIGH),
            (NEAR, FAR),
            ("curve_mean", "light", "above", "below", "jump"),
        ),
        Curves(
            "Wrapping zones",
            "Overestimation .25. `jump`: the greatest change within 1/2000 of the range.",
            {"wrapping zone": DISTRIBUTION},
            tuple(ZONES.values()),
            (NEAR, FAR),
            ("curve_mean", "light", "above", "below", "jump"),
        ),
        Sweep(
            CONTINUITY,
            "Each ray's steepest place, within 1/2000 of the range: mean and 99 %.",
            "fragments of a ray",
            (2, 4, 8, 16),
            samples,
            tuple(ZONES.values()),
            ("jump", "jump_p99", "T_rmse"),
            ("jump",),
            _steepness,
            {"tiny": 20, "small": 500, "full": 4000},
        ),
    ),
    claims=(
        Claim(
            "Overestimation 0 is closer to a lower, 1 to an upper bound of absorbance.",
            "section 5.1",
            (
                Less(Of("light", HIGH, "overestimation"), Of("light", MIDDLE, "overestimation")),
                Less(Of("light", MIDDLE, "overestimation"), Of("light", LOW, "overestimation")),
            ),
        ),
        Claim(
            "Neither is a proper bound.",
            "section 5.1",
            (
                Less(1e-4, Of("below", LOW, "overestimation")),
                Less(1e-4, Of("above", HIGH, "overestimation")),
            ),
        ),
        Claim(
            "Without a wrapping zone the reconstruction is not continuous.",
            "section 5.2",
            (Less(_jump("pi/10"), _jump("0"), 0.5),),
        ),
        Claim(
            "A larger wrapping zone gives smoother curves.",
            "section 5.2, figure 4b",
            (Rising((_jump("pi/4"), _jump("pi/10"), _jump("pi/100"), _jump("0"))),),
        ),
        Claim(
            "It costs precision of depth.",
            "section 5.2",
            tuple(
                Less(
                    Of("T_rmse", ZONES["pi/100"], CONTINUITY, count),
                    Of("T_rmse", ZONES["pi/4"], CONTINUITY, count),
                )
                for count in (2, 4, 8)
            ),
        ),
    ),
)


EXPERIMENTS = (FIGURE_3, FIGURE_4)
