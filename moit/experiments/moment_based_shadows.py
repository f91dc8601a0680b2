"""MBOIT's figure 9 and table 2: shadows through transparent casters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from moit import scenes
from moit.experiments.claims import Claim, Less, Near, Of
from moit.experiments.description import Array, Experiment, Published
from moit.experiments.moment_based_rays import PAPER
from moit.experiments.shadows import Lit, Shadows
from moit.scenes.cloud_scene import DISK_CENTER, DISK_RADIUS, LIGHT, cloud_casters

CLOUD, SHIP = "cloud-with-disk", "ship-like"
HALF, QUARTER, NONE = (f"(overestimation={share})" for share in (0.5, 0.25, 0.0))
F7, F15 = "fourier7", "fourier15"


def _cloud() -> Lit:
    return Lit(scenes.meshes(CLOUD), cloud_casters(np.random.default_rng(0)), LIGHT)


def _ship() -> Lit:
    scene = scenes.meshes(SHIP)
    casters = [mesh for mesh in scene.meshes if mesh.transparent.any()]
    return Lit(scene, casters, (-0.35, -1.0, -0.45))


def _below_disk(points: Array) -> tuple[Array, NDArray[np.bool_]]:
    """How far points are below the disk along the light, and whether it is above or below them."""
    forward = np.array(LIGHT) / np.linalg.norm(LIGHT)
    t = (DISK_CENTER[1] - points[:, 1]) / forward[1]  # along the light from the disk's plane
    met = points + t[:, None] * forward
    away = np.linalg.norm((met - DISK_CENTER)[:, [0, 2]], axis=1)
    return -t, away < 0.8 * DISK_RADIUS


def _onset(points: Array, exact: Array) -> NDArray[np.bool_]:
    """Just above and just below the disk."""
    below, inside = _below_disk(points)
    return np.asarray(inside & (np.abs(below) < 0.3))


def _umbra(points: Array, exact: Array) -> NDArray[np.bool_]:
    """Below the disk, in the cloud or under it."""
    below, inside = _below_disk(points)
    return np.asarray(inside & (below > 0.1))


def _top(points: Array, exact: Array) -> NDArray[np.bool_]:
    """What the light reaches first."""
    return np.asarray((exact > 0.9) & (points[:, 1] > 1.0))


def _at(column: str, technique: str) -> Of:
    return Of(column, technique, CLOUD)


FIGURE_9 = Experiment(
    name="mboit-fig9",
    paper=PAPER,
    figure="figure 9",
    title="a cloud with a red disk and its volumetric shadow",
    about=(
        "Light from above through particles and a red disk of 94 % opacity. Shadow maps of 512 "
        "texels a side at small size (1024 at full, as the paper), filtered by 9 x 9 texels, are "
        "asked for all fragments of the picture and held against rays cast through all casters. "
        "The picture itself is composited in depth order, so that shadows alone differ."
    ),
    parts=(
        Shadows(
            "Pictures and errors",
            "Onset: within .3 above and below the disk; umbra: below it; top: where nine tenths of "
            "the light come and more. `light`: mean signed error, below 0 too dark.",
            {CLOUD: _cloud},
            (
                F7, F15, f"power4{HALF}", f"power6{HALF}", f"power6{QUARTER}", f"power4{NONE}",
                f"power6{NONE}", f"trig3{HALF}",
            ),
            ("bits_per_texel", "rmse", "rmse onset", "light umbra", "rmse top", "light top"),
            {"onset": _onset, "umbra": _umbra, "top": _top},
        ),
    ),
    claims=(
        Claim(
            "Fourier opacity mapping fails to give the disk's shadow a hard onset; moments do.",
            "section 7.2, figure 9",
            (
                Less(_at("rmse onset", f"power6{HALF}"), _at("rmse onset", F7)),
                Less(_at("rmse onset", f"power6{QUARTER}"), _at("rmse onset", F7)),
                Less(_at("rmse onset", f"power6{HALF}"), _at("rmse onset", F15)),
                Less(_at("rmse onset", f"power6{QUARTER}"), _at("rmse onset", F15)),
                Less(_at("rmse onset", f"power4{HALF}"), _at("rmse onset", F7)),
            ),
        ),
        Claim(
            "With Fourier opacity mapping the directly lit top is slightly darkened already.",
            "section 7.2",
            (
                Less(_at("light top", F7), -0.001),
                Less(_at("light top", F15), -0.001),
            ),
        ),
        Claim(
            "Four and six moments are similar here but for slightly less wrong self-shadowing with "
            "six.",
            "section 7.2",
            (
                Near(_at("rmse", f"power4{HALF}"), _at("rmse", f"power6{HALF}"), 0.02),
                Less(_at("rmse top", f"power6{HALF}"), _at("rmse top", f"power4{HALF}")),
            ),
        ),
        Claim(
            "With an overestimation of 0 four power moments leak a lot of light; six are more "
            "robust.",
            "section 7.2",
            (
                Less(0.02, _at("light umbra", f"power4{NONE}")),
                Less(_at("light umbra", f"power6{NONE}"), _at("light umbra", f"power4{NONE}")),
                Less(_at("rmse", f"power6{NONE}"), _at("rmse", f"power4{NONE}")),
            ),
        ),
    ),
)  # fmt: skip

# Table 2: bits a texel, and milliseconds of a frame beyond one without shadows, at 1024 x 1024.
P4, P6 = "power4", "power6"
_TABLE_2 = {
    F7: (112, 1.0, 4.7), F15: (240, 1.3, 7.4), P4: (160, 1.5, 5.8), P6: (224, 2.0, 8.8),
}  # fmt: skip
_MS: dict[tuple[str | None, str], float] = {
    (scene, name): numbers[column]
    for column, scene in ((1, SHIP), (2, CLOUD))
    for name, numbers in _TABLE_2.items()
}


def _ms(technique: str, scene: str) -> Of:
    return Of("ms", technique, scene)


TABLE_2 = Experiment(
    name="mboit-table2",
    paper=PAPER,
    figure="table 2",
    title="run times of shadows",
    about=(
        "Milliseconds to draw and filter a map (pass 1) and to ask it for every fragment of the "
        "picture (pass 2), on this processor, beside the paper's frame times beyond those without "
        "shadows at 1024 x 1024 texels on an NVIDIA GeForce GTX 1080 Ti. Ratios compare: 1 is six "
        "power moments. One run each."
    ),
    parts=(
        Shadows(
            "Times, memory and errors",
            "",
            {SHIP: _ship, CLOUD: _cloud},
            tuple(_TABLE_2),
            ("bits_per_texel", "rmse", "first_ms", "second_ms", "ms"),
            pictures=False,
            published=Published(
                "MBOIT, table 2",
                "GTX 1080 Ti, 2018",
                {
                    "paper_bits_per_texel": {
                        (None, name): row[0] for name, row in _TABLE_2.items()
                    },
                    "paper_ms": _MS,
                },
            ),
            base=P6,
        ),
    ),
    claims=(
        Claim(
            "Memory is as listed.",
            "table 2",
            tuple(
                Near(Of("bits_per_texel", name, SHIP), float(row[0]), 0.0)
                for name, row in _TABLE_2.items()
            ),
        ),
        Claim(
            "Fourier opacity mapping is always faster with 7 coefficients.",
            "section 7.3",
            tuple(
                Less(_ms(F7, scene), _ms(one, scene)) for scene in (SHIP, CLOUD) for one in (P4, P6)
            ),
        ),
        Claim(
            "With 15 it falls between four and six power moments or below.",
            "section 7.3",
            tuple(Less(_ms(F15, scene), _ms(P6, scene)) for scene in (SHIP, CLOUD)),
        ),
        Claim(
            "Moments are the better shadows.",
            "section 7.3",
            tuple(
                Less(Of("rmse", P6, scene), Of("rmse", one, scene))
                for scene in (SHIP, CLOUD)
                for one in (F7, F15)
            ),
        ),
    ),
)

EXPERIMENTS = (FIGURE_9, TABLE_2)
