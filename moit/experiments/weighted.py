"""McGuire and Bavoil, "Weighted Blended Order-Independent Transparency", JCGT 2013, and McGuire's
post on its implementation: the test scene, the weights, the kinds of scenes, the precision."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from moit.experiments.claims import Claim, Less, Near, Of
from moit.experiments.comparisons import Comparison
from moit.experiments.description import Experiment
from moit.experiments.orders import Orders
from moit.experiments.rays import Sweep
from moit.fragments.fragments import Fragments
from moit.questions import composite, transmittance

PAPER = "Weighted, Blended Order-Independent Transparency (McGuire and Bavoil 2013)"
WEIGHTS = ("wboit", "wboit-eq7", "wboit-eq8", "wboit-eq9", "wboit-eq10", "wboit-phenomenological")
SQUARES = "squares"

TEST_SCENE = Experiment(
    name="wboit-test-scene",
    paper=PAPER,
    figure="test scene of the post",
    title="overlapping squares of pure colours",
    about=(
        "The post's picture has squares of pure colours, blue with an opacity of .75, weighted by "
        "equation 9. Its other numbers are not in the text; ours are a scene of that kind."
    ),
    parts=(
        Comparison(
            "Pictures and errors",
            "`outside`: how far colours go at most beyond those of a pixel's fragments and wall. "
            "`coverage`: the greatest error of what is covered. `shuffle`: what another order of "
            "arrival changes at most.",
            (SQUARES,),
            (*WEIGHTS, "wboit-eq9(bits=16)", "weighted-average", "weighted-sum", "unsorted"),
            columns=("bits_per_pixel", "flip", "rmse", "outside", "coverage", "shuffle"),
            shown=("wboit-eq9", "wboit", "wboit-eq7", "weighted-average", "unsorted"),
            crop=(0.15, 0, 0.85, 1),
        ),
    ),
    claims=(
        Claim(
            "It is a blending operation: no result is outside the range of the original surfaces.",
            "post",
            tuple(Less(Of("outside", one, SQUARES), 1e-5) for one in WEIGHTS),
        ),
        Claim(
            "Coverage of the background is exact.",
            "post",
            tuple(Less(Of("coverage", one, SQUARES), 1e-5) for one in WEIGHTS),
        ),
        Claim(
            "No order is needed.",
            "post",
            (
                *(Less(Of("shuffle", one, SQUARES), 1e-5) for one in WEIGHTS),
                Less(0.05, Of("shuffle", "unsorted", SQUARES)),
            ),
        ),
    ),
)

DEPTHS = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 200.0, 300.0, 500.0)
WEIGHT_OF_DEPTH = "weights over depth"
SCALES = (0.1, 1.0, 10.0, 100.0)


def _pair(rng: np.random.Generator, depth: float, rays: int) -> Fragments:
    """One ray: a fragment at depth 1, and one at that depth."""
    return Fragments(
        [0, 2], [1.0, depth], [0.5, 0.5], [[0.5] * 3] * 2, depth_range=(0.1, 500), dtype="f8"
    )


def _weight(f: Fragments, name: str) -> dict[str, float | None]:
    first, second = transmittance(f, name).tolist()
    return {"weight": second / first if first > 0 else None}


def _scaled(name: str, scale: float) -> str:
    return name if scale == 1 else f"{name}(depth_scale={scale})"


def _errors(scene: str) -> tuple[Of, ...]:
    return tuple(Of("flip", _scaled("wboit", scale), scene) for scale in SCALES)


TUNED = ("smoke", "engine", "pond")
WEIGHT_FUNCTIONS = Experiment(
    name="wboit-weights",
    paper=PAPER,
    figure="weight functions",
    title="weights over depth, and what their tuning is worth",
    about=(
        "The paper's equations 7 to 10, the post's weight and the one in wide use. They are made "
        "for depths up to 500; how much the unit of depth matters is measured on three scenes "
        "whose depths are of a few units, by scaling these."
    ),
    parts=(
        Sweep(
            WEIGHT_OF_DEPTH,
            "Of a fragment of alpha .5, in ratio to one at depth 1.",
            "depth",
            DEPTHS,
            _pair,
            WEIGHTS,
            ("weight",),
            ("weight",),
            _weight,
            {"tiny": 1, "small": 1, "full": 1},
            least=1e-12,
        ),
        Comparison(
            "Errors by weight and by unit of depth",
            "`depth_scale`: units for which weights are tuned in one unit of the scene.",
            TUNED,
            (
                *WEIGHTS,
                *(_scaled("wboit", scale) for scale in SCALES if scale != 1),
                *(_scaled("wboit-eq7", scale) for scale in (10.0, 100.0)),
                "weighted-average",
            ),
            columns=("flip", "ssim", "rmse", "front"),
            shown=("wboit", _scaled("wboit", 10.0), _scaled("wboit", 100.0), "weighted-average"),
            front=True,
        ),
    ),
    claims=(
        Claim(
            "The weight must be tuned for the depth range of transparent surfaces.",
            "post",
            tuple(
                Less(Of("flip", _scaled("wboit", 10.0), scene), Of("flip", "wboit", scene), 0.9)
                for scene in TUNED
            ),
        ),
        Claim(
            "Weights give precedence to nearer surfaces.",
            "post",
            tuple(
                Less(
                    Of("weight", one, WEIGHT_OF_DEPTH, 300.0),
                    Of("weight", one, WEIGHT_OF_DEPTH, 1.0),
                )
                for one in WEIGHTS[:5]
            ),
        ),
        Claim(
            "A weight of depth is better than none.",
            "post",
            tuple(
                Less(
                    Of("flip", _scaled("wboit", 10.0), scene), Of("flip", "weighted-average", scene)
                )
                for scene in TUNED
            ),
        ),
    ),
)

KINDS = ("engine", "chess", "pond", "smoke")
POND = "pond"
SCENES = Experiment(
    name="wboit-scenes",
    paper=PAPER,
    figure="pictures of the post",
    title="an engine in glass, chess, a pond with fog, smoke",
    about=(
        "Generated scenes of the kinds that the post shows. The weight is the post's, once as it "
        "stands and once with ten of its units to one of the scene's."
    ),
    parts=(
        Comparison(
            "Pictures and errors",
            "`coverage`: the greatest error of what is covered. `shuffle`: what another order of "
            "arrival changes at most.",
            KINDS,
            ("wboit", _scaled("wboit", 10.0), "wboit-eq9", "unsorted", "kbuffer4", "power6"),
            columns=("bits_per_pixel", "flip", "ssim", "rmse", "coverage", "outside", "shuffle"),
            shown=("wboit", _scaled("wboit", 10.0), "unsorted"),
        ),
        Orders(
            "Sorting by object and by triangle",
            "Blending without order-independence. `wrong`: the share of pixels that are off by "
            "more than 1/16. Triangles are small here, where the post has a few large ones.",
            (POND,),
            ("wboit", "power6"),
        ),
    ),
    claims=(
        Claim(
            "The background's coverage is exact, and no order is needed.",
            "post",
            tuple(
                test
                for scene in KINDS
                for test in (
                    Less(Of("coverage", "wboit", scene), 1e-5),
                    Less(Of("shuffle", "wboit", scene), 1e-3),
                )
            ),
        ),
        Claim(
            "No result is outside the range of the original surfaces.",
            "post",
            tuple(Less(Of("outside", "wboit", scene), 1e-4) for scene in KINDS),
        ),
        Claim(
            "Quality is pretty good: nearer to the truth than blending without order.",
            "post",
            tuple(
                Less(Of("flip", "wboit", scene), Of("flip", "unsorted", scene)) for scene in KINDS
            ),
        ),
        Claim(
            "It keeps less than a k-buffer of four layers.",
            "post",
            (
                Less(
                    Of("bits_per_pixel", "wboit", "engine"),
                    Of("bits_per_pixel", "kbuffer4", "engine"),
                ),
            ),
        ),
        Claim(
            "Sorted transparency cannot render the pond: no order of triangles is right.",
            "post",
            (
                Less(0.005, Of("wrong", "sorted objects", POND)),
                Less(0.0, Of("wrong", "sorted triangles", POND)),
            ),
        ),
        Claim(
            "There weighted blending is more convincing than sorted triangles.",
            "post",
            (Less(Of("flip", "wboit", POND), Of("flip", "sorted triangles", POND)),),
        ),
    ),
)

HALVES = tuple("wboit(bits=16)" if one == "wboit" else f"{one}(bits=16)" for one in WEIGHTS)
OPAQUE, THINNER = "alpha .2 to .9", "alpha falls with the number"


def _surfaces(rng: np.random.Generator, count: float, rays: int) -> Fragments:
    """Rays of that many surfaces of alpha .2 to .9, evenly spread over the logarithm of depth."""
    return _rays(rng, int(count), rays, 1.0)


def _thinner(rng: np.random.Generator, count: float, rays: int) -> Fragments:
    """The same, of alphas that fall where there are many, as in smoke."""
    return _rays(rng, int(count), rays, min(1.0, 4.0 / count))


def _rays(rng: np.random.Generator, n: int, rays: int, share: float) -> Fragments:
    alpha = 1 - (1 - rng.uniform(0.2, 0.9, (rays, n))) ** share
    return Fragments(
        np.arange(rays + 1) * n,
        np.exp(rng.uniform(np.log(0.1), np.log(500), (rays, n))).ravel(),
        alpha.ravel(),
        rng.uniform(0, 1, (rays * n, 3)),
        depth_range=(0.1, 500),
        dtype="f4",
    )


def _rounding(f: Fragments, name: str) -> dict[str, float | None]:
    """What half floats and a byte change in pictures: the colour of what is covered, and coverage;
    and the share of pixels whose colour is outside that of their fragments."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # that halves overflow is what is measured
        halves = composite(f, name)[0]
    floats = composite(f, name.replace("(bits=16)", ""))[0]
    begin = f.offsets[:-1]
    assert f.color is not None
    least, most = (one.reduceat(f.color, begin) for one in (np.minimum, np.maximum))
    seen = np.maximum(halves[:, 3:], 1e-3)
    color = halves[:, :3] / seen
    off = np.abs(color - floats[:, :3] / np.maximum(floats[:, 3:], 1e-3)).max(axis=1)
    out = np.maximum(least - color, color - most).max(axis=1)
    return {
        "color_p99": float(np.percentile(off, 99)),
        "color_max": float(off.max()),
        "outside_share": float((out > 0.02).mean()),
        "coverage": float(np.abs(halves - floats)[:, 3].max()),
    }


_COUNTS = (1, 2, 5, 10, 20, 50, 100, 200, 500)


def _sweep(
    title: str, text: str, make: Callable[[np.random.Generator, float, int], Fragments]
) -> Sweep:
    return Sweep(
        title,
        text,
        "surfaces of a pixel",
        _COUNTS,
        make,
        HALVES,
        ("color_p99", "color_max", "outside_share", "coverage"),
        ("color_p99",),
        _rounding,
        {"tiny": 20, "small": 1000, "full": 10_000},
        least=1e-5,
    )


PRECISION = Experiment(
    name="wboit-precision",
    paper=PAPER,
    figure="precision",
    title="half floats with 1 to 100 surfaces",
    about=(
        "Targets of 16 bits, a half float a sum and a byte for what is let through, beside floats: "
        "each fragment's contribution is rounded as it arrives. Depths from .1 to 500, for which "
        "the weights are made."
    ),
    parts=(
        _sweep(
            OPAQUE,
            "`color_p99`, `color_max`: how far the colour of what is covered is from that of "
            "floats. `outside_share`: of pixels whose colour is by more than .02 outside that of "
            "their fragments: underflow and overflow.",
            _surfaces,
        ),
        _sweep(
            THINNER, "As above, with less opaque surfaces where there are more than four.", _thinner
        ),
    ),
    claims=(
        Claim(
            "The paper's curves avoid precision problems with 1 to 100 surfaces of alpha .2 to .9.",
            "post",
            tuple(
                Less(Of("color_p99", one, OPAQUE, count), 0.02)
                for one in HALVES[1:5]
                for count in (1, 10, 100)
            ),
        ),
        Claim(
            "So does the post's weight.",
            "post",
            tuple(Less(Of("color_p99", HALVES[0], OPAQUE, count), 0.02) for count in (1, 10, 100)),
        ),
        Claim(
            "In scenes with very many surfaces these have lower alpha: then, too.",
            "post",
            tuple(
                Less(Of("color_p99", one, THINNER, count), 0.02)
                for one in HALVES[:5]
                for count in (100, 500)
            ),
        ),
        Claim(
            "Eight bits for coverage suffice.",
            "post",
            tuple(Near(Of("coverage", HALVES[0], OPAQUE, n), 0.0, 2.5 / 255) for n in (10, 100)),
        ),
    ),
)

EXPERIMENTS = (TEST_SCENE, WEIGHT_FUNCTIONS, SCENES, PRECISION)
