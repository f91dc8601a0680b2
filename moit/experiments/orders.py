"""What sorting by object or by triangle makes of a scene, beside techniques that need no order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from moit import metrics, scenes
from moit.comparing.report import Row
from moit.experiments.description import PICTURE, Picture, Section, Setting
from moit.rendering.render import render

SORTED = {"given": "in draw order", "object": "sorted objects", "triangle": "sorted triangles"}


@dataclass(frozen=True)
class Orders:
    """Blending in several orders of triangles, and techniques: FLIP, RMSE, and the share of pixels
    that are off by more than 1/16."""

    title: str
    text: str
    scenes: Sequence[str]
    techniques: Sequence[str]
    size: Mapping[str, tuple[int, int]] = field(default_factory=lambda: PICTURE)

    def steps(self) -> int:
        return len(self.scenes)

    def run(self, setting: Setting) -> Section:
        rows = []
        gallery = []
        size = self.size[setting.size]
        for name in self.scenes:
            scene = scenes.meshes(name)
            exact = render(scene, "sorted", size, device=setting.device)
            made = {
                words: render(scene, "unsorted", size, device=setting.device, order=order)
                for order, words in SORTED.items()
            }
            for one in self.techniques:
                made[one] = render(scene, one, size, device=setting.device)
            pictures = [Picture(f"{name}-order-exact", f"{name}, exact", exact[..., :3])]
            for words, image in made.items():
                flip = float(metrics.flip(image, exact))
                off = np.abs(image - exact)[..., :3].max(axis=-1)
                rows.append(
                    Row(
                        scene=name,
                        technique=words,
                        flip=flip,
                        rmse=float(metrics.rmse(image, exact)),
                        wrong=float((off > 1 / 16).mean()),
                    )
                )
                caption = f"{words}, FLIP {flip:.3f}"
                pictures.append(Picture(f"{name}-order-{words}", caption, image[..., :3]))
            gallery.append(pictures)
            setting.done(name)
        columns = ("scene", "technique", "flip", "rmse", "wrong")
        return Section(self.title, self.text, columns, rows, gallery)
