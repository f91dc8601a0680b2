"""Sharpe, "Moment Transparency", HPG 2018: figures 1 to 3 and table 1."""

from __future__ import annotations

import numpy as np

from moit.experiments.claims import Claim, Less, Of
from moit.experiments.description import Experiment
from moit.experiments.rays import Curves, Ray, Sweep
from moit.fragments import Fragments

PAPER = "Moment Transparency (Sharpe 2018)"
MT, OVER, TWO = (
    "moment-transparency",
    "moment-transparency(overestimation=0.25)",
    "two-moments-pass",
)
NEAR, FAR = 1.0, 4.0


def samples(rng: np.random.Generator, count: float, rays: int) -> Fragments:
    """Rays of that many fragments of alpha .2 to .8, evenly spread over the warped range."""
    n = int(count)
    depth = NEAR * (FAR / NEAR) ** rng.uniform(0.05, 0.95, (rays, n))
    alpha = rng.uniform(0.2, 0.8, (rays, n))
    return Fragments(
        np.arange(rays + 1) * n, depth.ravel(), alpha.ravel(), depth_range=(NEAR, FAR), dtype="f4"
    )


MANY = "random rays"


def _at(column: str, technique: str, count: float) -> Of:
    return Of(column, technique, MANY, count)


FIGURE_2 = Experiment(
    name="mt-fig2",
    paper=PAPER,
    figure="figure 2",
    title="transmittance from four moments",
    about=(
        "Curves of Moment Transparency, of its variant with 25 % overestimation, and of two "
        "moments passes, beside the exact ones. The paper shows single rays of 2, 3 and more "
        "samples; to these come errors over many random rays. Signed errors below 0 mean that too "
        "little light gets there (the paper: overshadowing)."
    ),
    parts=(
        Curves(
            "Single rays",
            "Errors over depth of the curve; `T max` is at the samples.",
            {
                "2 samples": Ray((1.5, 2.6), (0.5, 0.6)),
                "3 samples": Ray((1.4, 2.0, 3.0), (0.4, 0.5, 0.5)),
                "5 samples": Ray((1.3, 1.6, 2.1, 2.6, 3.3), (0.4, 0.3, 0.5, 0.3, 0.5)),
                "12 samples": Ray(
                    tuple(np.geomspace(1.2, 3.6, 12).round(3).tolist()), (0.2, 0.3, 0.25, 0.2) * 3
                ),
            },
            (MT, OVER, TWO),
            (NEAR, FAR),
        ),
        Sweep(
            MANY,
            "Alpha .2 to .8, depths evenly spread. `T rmse` and `signed`: over the depth range; "
            "`front`: transmittance to each ray's nearest sample, beside 1.",
            "samples of a ray",
            (1, 2, 3, 4, 5, 6, 8, 12, 16, 24, 32),
            samples,
            (MT, OVER, TWO),
        ),
    ),
    claims=(
        Claim(
            "For two samples the reconstruction is exact.",
            "section 3.1",
            (
                # MT scales every alpha by 1 - .5/256, which two samples see twice
                Less(Of("curve_max", MT, "2 samples"), 1 / 256),
                Less(_at("T_rmse", MT, 2), _at("T_rmse", MT, 3), 0.4),
            ),
        ),
        Claim(
            "For more it becomes approximate: a good match for 2 and 3 samples only.",
            "section 3.1, figure 2",
            (
                Less(_at("T_rmse", MT, 2), _at("T_rmse", MT, 3)),
                Less(_at("T_rmse", MT, 3), _at("T_rmse", MT, 4)),
                Less(_at("T_rmse", MT, 3), _at("T_rmse", MT, 8), 0.75),
            ),
        ),
        Claim(
            "Overestimation of 25 % is an improvement.",
            "figure 2",
            tuple(
                Less(_at("T_rmse", OVER, count), _at("T_rmse", MT, count))
                for count in (3, 4, 8, 16, 32)
            ),
        ),
        Claim(
            "It overshadows in the front.",
            "figure 2",
            tuple(Less(_at("front", OVER, count), _at("front", MT, count)) for count in (3, 8, 16)),
        ),
        Claim(
            "Two moments passes overshadow with 2 and 3 samples.",
            "figure 2",
            tuple(Less(_at("light", TWO, count), 0.0) for count in (2, 3)),
        ),
        Claim(
            "Two moments passes are an improvement for anything higher.",
            "figure 2",
            tuple(
                Less(_at("T_rmse", TWO, count), _at("T_rmse", MT, count))
                for count in (4, 5, 6, 8, 16, 32)
            ),
        ),
        Claim(
            "Moments under-occlude: without either, too much light gets through.",
            "section 4.4",
            tuple(Less(0.0, _at("light", MT, count)) for count in (4, 8, 16, 32)),
        ),
    ),
)

EXPERIMENTS = (FIGURE_2,)
