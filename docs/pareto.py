"""Draws pareto.png of techniques.md, time against error: `python docs/pareto.py`.

Times are those of the machine it runs on; what leads, and by how much, is what to look at.
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import moit
from moit.system.files import replacing

SCENES = ("mixed", "hair", "cloud")
SIZE = (480, 360)
# One of each idea, and those of which the papers tell most; the report has all.
TECHNIQUES = (
    "sorted",
    "unsorted",
    "weighted-average",
    "wboit",
    "wboit-eq7",
    "moment-transparency",
    "two-moments-pass",
    "power4",
    "power4(exclude_self=True)",
    "power6",
    "power8",
    "trig2",
    "trig3",
    "fourier7",
    "adaptive4",
    "mlab4",
    "mlab6",
    "hybrid4",
    "wavelet8",
    "stochastic8",
    "neural",
    "neural-bounded",
    "neural-bounded6",
)


def main() -> None:
    scenes = {name: moit.scenes.load(name, SIZE) for name in SCENES}
    report = moit.compare(scenes, TECHNIQUES, metrics=["flip"], repeat=7)
    figure, axes = plt.subplots(1, len(SCENES), figsize=(13, 4.4), dpi=80, layout="constrained")
    for ax, (name, f) in zip(axes, scenes.items(), strict=True):
        moit.plot.speed_error(report, scene=name, ax=ax, labels=TECHNIQUES, legend=False)
        ax.margins(x=0.12)
        ax.set_title(f"{name}: {len(f) / f.counts.size:.0f} fragments a pixel on average", size=10)
        ax.set_ylabel("mean FLIP" if ax is axes[0] else "")
    with replacing(Path(__file__).with_name("pareto.png")) as part:
        figure.savefig(part)


if __name__ == "__main__":
    main()
