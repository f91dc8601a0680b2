"""Draws overview.png of README and meshes.png of drawing.md: `python docs/overview.py`."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import moit
from moit.system.files import replacing

BACKGROUND = (0.05, 0.055, 0.07)
# Rows and columns of overview.png, and of meshes.png; the exact picture is the first.
SCENES, TECHNIQUES, SIZE = (
    ("panes", "spheres", "cloud"),
    ("wboit", "power4", "power6", "trig3", "mlab4"),
    (360, 270),
)
MESHES, MESH_TECHNIQUES, MESH_SIZE = (
    ("teapots", "foliage", "ship-like"),
    ("wboit", "power6", "trig3"),
    (640, 360),
)
PIXELS = 1000  # how wide each is


def compared(scenes, techniques: tuple[str, ...], background) -> moit.Report:
    """The pictures of these techniques and their errors."""
    return moit.compare(
        scenes, techniques, metrics="flip", repeat=1, background=background, progress=False
    )


def of_triangles(names: tuple[str, ...]) -> moit.Report:
    """The same of scenes that each have a background of their own."""
    reports = []
    for name in names:
        scene = moit.scenes.meshes(name)
        fragments = moit.rasterize(scene.meshes, scene.camera, MESH_SIZE)
        reports.append(compared({name: fragments}, MESH_TECHNIQUES, scene.background))
    results = [result for report in reports for result in report.results]
    scenes = {name: report.scenes[name] for name, report in zip(names, reports, strict=True)}
    return moit.Report(results, scenes, ("flip",))


def draw(name: str, report: moit.Report) -> None:
    """A picture of each technique beside the exact one, and how far it is from that."""
    figure = moit.plot.images(report, errors=False)
    with replacing(Path(__file__).with_name(name)) as part:
        figure.savefig(part, dpi=PIXELS / figure.get_figwidth())


def main() -> None:
    scenes = {name: moit.scenes.load(name, SIZE) for name in SCENES}
    draw("overview.png", compared(scenes, TECHNIQUES, BACKGROUND))
    draw("meshes.png", of_triangles(MESHES))


if __name__ == "__main__":
    main()
