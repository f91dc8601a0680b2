"""Kern, Neuhauser, Maack, Han, Usher and Westermann, "A Comparison of Rendering Techniques for 3D
Line Sets with Transparency", IEEE TVCG 2021: streamlines whose opacity tells an attribute."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from moit import metrics, scenes
from moit.comparing.rows import Row
from moit.experiments.claims import Claim, Less, Of
from moit.experiments.description import PICTURE, Array, Experiment, Section, Setting
from moit.fragments.fragments import Fragments
from moit.questions import composite, transmittance
from moit.rendering.rasterizing import rasterize
from moit.reports.blocks import Picture

COUNTS = {"tiny": 60, "small": 700, "full": 4000}
LEAST = 0.05  # visibility of what counts as seen


@dataclass(frozen=True)
class Seen:
    """Of pixels where two fragments of lines are seen clearly, which these are and how.

    pixels : (P,). near, far : (P,) fragments, the one in front and the one behind.
    order : (P,) how much more of the nearer one is seen than were both at one depth: 1 less the
        ratio of what reaches them.
    """

    pixels: NDArray[np.int64]
    near: NDArray[np.int64]
    far: NDArray[np.int64]
    order: Array


def most_seen(f: Fragments) -> Seen:
    """The two fragments of each pixel of which most is seen, where that is at least LEAST of each,
    and more than a tenth of what reaches the nearer one does not reach the other."""
    reach = transmittance(f, "sorted").astype(np.float64)
    visible = reach * f.alpha
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    best = np.lexsort((-visible, pixel))
    starts = f.offsets[:-1][f.counts >= 2]
    pair = np.stack([best[starts], best[starts + 1]], axis=1)
    nearer = np.argsort(f.depth[pair], axis=1, kind="stable")
    near, far = np.take_along_axis(pair, nearer, axis=1).T
    order = 1 - reach[far] / np.maximum(reach[near], 1e-12)
    clear = (visible[near] >= LEAST) & (visible[far] >= LEAST) & (order > 0.1)
    clear &= f.depth[near] < f.depth[far]
    some = near[clear], far[clear]
    return Seen(pixel[some[0]], *some, order[clear])


def order_kept(f: Fragments, seen: Seen, technique: str) -> Array:
    """(P,) of a technique the share of `seen.order` that it keeps: 1 as it is, 0 where both are
    seen as though they were at one depth, below 0 where the farther one is seen in front.

    It is asked by colours, which all techniques have: the nearer one red, the farther one green.
    """
    color = np.zeros((len(f), 3), np.float32)
    color[seen.near, 0] = 1
    color[seen.far, 1] = 1
    probe = _colored(f, color)
    image = composite(probe, technique).reshape(-1, 4)[seen.pixels].astype(np.float64)
    near, far = image[:, 0] / f.alpha[seen.near], image[:, 1] / f.alpha[seen.far]
    found: Array = (1 - far / np.maximum(near, 1e-9)) / seen.order
    return found


def _colored(f: Fragments, color: NDArray[np.float32]) -> Fragments:
    return Fragments(
        f.offsets, f.depth, f.alpha, color, shape=f.shape, depth_range=f.depth_range, dtype=f.dtype
    )


@dataclass(frozen=True)
class LineSets:
    """Techniques on scenes of lines: errors of pictures, and of two lines that are seen through one
    another which is in front.

    Columns: "kept", the mean of `order_kept`, between -1 and 2 in each pixel; "reversed", the share
    of pixels where it is below 0; "lost", where it is above 0 but below a half.
    """

    title: str
    text: str
    scenes: Sequence[str]
    techniques: Sequence[str]
    shown: Sequence[str]
    size: Mapping[str, tuple[int, int]] = field(default_factory=lambda: PICTURE)

    def steps(self) -> int:
        return len(self.scenes) * (len(self.techniques) + 1)

    def run(self, setting: Setting) -> Section:
        rows, gallery = [], []
        for name in self.scenes:
            scene = scenes.lines(name, COUNTS[setting.size])
            f = rasterize(
                scene.lines, scene.camera, self.size[setting.size], antialias=True, progress=False
            )
            behind = scene.background
            exact = composite(f, "sorted", background=behind)[..., :3]
            seen = most_seen(f)
            pictures = [Picture(f"{name}-exact", f"{name}, exact", exact)]
            setting.done(name)
            for one in self.techniques:
                image = composite(f, one, background=behind, device=setting.device)[..., :3]
                kept = order_kept(f, seen, one)
                flip = float(metrics.flip(image, exact))
                row = Row(scene=name, technique=one, flip=flip)
                row |= {
                    "rmse": float(metrics.rmse(image, exact)),
                    "kept": float(np.clip(kept, -1, 2).mean()) if len(kept) else None,
                    "reversed": float((kept < -1e-3).mean()) if len(kept) else None,
                    "lost": float(((kept >= -1e-3) & (kept < 0.5)).mean()) if len(kept) else None,
                }
                rows.append(row)
                if one in self.shown:
                    pictures.append(Picture(f"{name}-{one}", f"{one}, FLIP {flip:.3f}", image))
                setting.done(f"{name}, {one}")
            gallery.append(pictures)
        columns = ("scene", "technique", "flip", "rmse", "kept", "lost", "reversed")
        return Section(self.title, self.text, columns, rows, gallery)


SCENES = ("turbulence-lines", "convection-lines")
MOMENTS = ("power4", "power6", "power8")
BUCKETS = "mlab8(buckets=True)"
LAYERS = ("mlab4", "mlab8", BUCKETS)
EXPERIMENT = Experiment(
    name="lines",
    paper="A Comparison of Rendering Techniques for 3D Line Sets with Transparency (2021)",
    figure="comparison of image quality",
    title="streamlines whose opacity tells an attribute",
    about=(
        "Generated flows of the kinds that are shown there: tubes, faint where the attribute is "
        "small and nearly opaque where it is great, with coverage at their edges. The paper's "
        "multi-layer alpha blending has buckets of depth (MLABDB). Which of two lines is in front "
        "is asked where both are seen clearly (at least .05 of each): `kept` is 1 where a "
        "technique tells it as it is and 0 where it shows both at one depth; `lost`: the share of "
        "pixels below a half; `reversed`: where it shows the farther one in front."
    ),
    parts=(
        LineSets(
            "Pictures, errors and what is in front",
            "Lines come in the order of their seeds.",
            SCENES,
            (*MOMENTS, *LAYERS, "kbuffer4", "hybrid4", "wboit", "unsorted"),
            ("power4", "power8", "mlab4", BUCKETS, "kbuffer4", "wboit"),
        ),
    ),
    claims=(
        Claim(
            "Moments blur: lines are seen at depths that are not told apart, though never in a "
            "wrong order.",
            "discussion of MBOIT",
            tuple(
                test
                for scene in SCENES
                for test in (
                    Less(0.1, Of("lost", "power4", scene)),
                    Less(Of("reversed", "power4", scene), 1e-3),
                )
            ),
        ),
        Claim(
            "Multi-layer alpha blending keeps lines sharp, and shows some in a wrong order.",
            "discussion of MLABDB",
            tuple(
                test
                for scene in SCENES
                for one in ("mlab4", BUCKETS)
                for test in (
                    Less(Of("lost", one, scene), Of("lost", "power4", scene), 0.2),
                    Less(0.005, Of("reversed", one, scene)),
                )
            ),
        ),
        Claim(
            "Buckets of depth put faint lines in front into one layer, which blends them as they "
            "come: more are reversed than by as many layers without.",
            "ours",
            tuple(
                Less(Of("reversed", "mlab8", scene), Of("reversed", BUCKETS, scene))
                for scene in SCENES
            ),
        ),
        Claim(
            "More moments and more layers lessen it.",
            "ours",
            tuple(
                test
                for scene in SCENES
                for test in (
                    Less(Of("lost", "power8", scene), Of("lost", "power4", scene)),
                    Less(Of("reversed", "mlab8", scene), Of("reversed", "mlab4", scene)),
                )
            ),
        ),
        Claim(
            "Without order or depth's distribution the farther line is in front as often as not.",
            "ours",
            tuple(
                Less(0.25, Of("reversed", one, scene))
                for scene in SCENES
                for one in ("wboit", "unsorted")
            ),
        ),
    ),
)
EXPERIMENTS = (EXPERIMENT,)
