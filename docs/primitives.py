"""Writes primitives.md and primitives.png: points, lines, volumes, smooth edges, and their costs.

    python docs/primitives.py [--threads 2]

Seconds are those of processors, of all threads together: what else runs changes them little.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

import moit
from moit.scenes.scene_parts import teapot
from moit.system.files import replacing, write_text

HERE = Path(__file__).parent
SIZE = (480, 320)
COST_SIZE = (1280, 720)
SKY = (0.55, 0.7, 0.9)
VIEW = moit.Camera((1.7, 1.2, 2.6), (0, 0.45, 0), fov_y=0.7, near=0.3, far=20)


TEXT = """# Points, lines, volumes, and smooth edges

Scenes may have triangles, Gaussian splats ([splats.md](splats.md)), points, lines and volumes, in
any order: each becomes fragments, and every technique takes them. A GPU draws points and lines,
too: on llvmpipe the CPU's fragments, bit for bit. Volumes, and what triangles cover of pixels, are
the CPU's: where a GPU is asked, a warning says so.

![Spheres, streamlines, a cloud, a mixed scene, and edges](primitives.png)

```python
opacity = moit.map_scalars(speed, "viridis", (0.02, 0.1, 0.9))  # (N, 4): colours and opacities
cloud = moit.Points(places, radius=0.03, color=opacity, shape="sphere")  # or pixels=4; "disc"
flow = moit.Lines(points, offsets, radius=0.01, color=opacity, shape="tube")  # or "ribbon"
smoke = moit.Volume(absorbance, spacing=0.1)  # (X, Y, Z), or numbers and a transfer function
image = moit.render([room, cloud, flow, smoke], "power6", (1280, 720), antialias=True)
```

- **Points** are discs that face the picture, or spheres as rays meet them, lit as triangles are.
- **Lines** are what such a disc or ball leaves on its way from point to point, so that bends and
  ends are round. A pixel has one fragment of a line where parts that follow each other meet or
  overlap, and another where the line crosses itself, or comes back at another depth; a line whose
  last point is its first has no seam.
- **Volumes** are marched cell by cell to thick fragments. What they absorb is exact where
  absorbance is linear between points of the grid.
- **pyvista.PolyData** are taken by `moit.Points` (their verts), `moit.Lines` (their lines) and
  `moit.Mesh` (their faces).
- **antialias=True** makes a pixel's alpha count by the share of it that is covered: by areas of
  triangles, and by 64 samples of points and lines. What neighbours cover of a pixel adds up: two
  triangles that share a corner and are seen from one side are one surface there, so that no seam is
  seen between them, and a closed opaque surface stays opaque. Edges of opaque surfaces are
  transparent, so that a technique without order shows them as it shows glass.

How well techniques tell which of two lines is in front: `moit experiment lines`,
[claims.md](claims.md). Kern et al. (2021) found that moments blur lines and that multi-layer alpha
blending shows some in a wrong order; so it is here."""


def cloud(points: int, place: tuple[float, float, float] = (-1, -0.55, -1)) -> moit.Volume:
    """A cloud: a sum of soft balls, darker where more of it is above."""
    rng = np.random.default_rng(0)
    steps = np.linspace(-1, 1, points)
    at = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1)
    density = np.zeros(at.shape[:3])
    for middle, wide in zip(rng.normal(0, 0.3, (14, 3)), rng.uniform(0.12, 0.3, 14), strict=True):
        density += np.exp(-((at - middle * (1, 0.5, 1)) ** 2).sum(axis=-1) / wide**2)
    density = np.maximum(density - 0.25, 0) * 5
    above = np.cumsum(density[:, ::-1], axis=1)[:, ::-1] * 2 / (points - 1)
    light = (0.35 + 0.6 * np.exp(-0.8 * above))[..., None] * (0.95, 0.97, 1.0)
    grid = np.concatenate([light, density[..., None]], axis=3)
    return moit.Volume(grid, 2 / (points - 1), origin=place)


def spheres(count: int, **how: Any) -> moit.Points:
    """Points in a ball, coloured by height, clearer the lower they are."""
    rng = np.random.default_rng(3)
    places = rng.normal(size=(count, 3))
    places *= (rng.random(count) ** (1 / 3) / np.linalg.norm(places, axis=1))[:, None]
    colors = moit.map_scalars(places[:, 1], "plasma", (0.08, 0.9))
    return moit.Points(places * 0.9 + (0, 0.45, 0), color=colors, **how)


def pot() -> list[moit.Mesh]:
    return [
        moit.Mesh(one.points, one.triangles, (0.8, 0.3, 0.12), 0.45, one.normals)
        for one in teapot((0.8, 0.3, 0.12), 0.45)
    ]


def drawn(scene: Any, camera: moit.Camera, background: Any, **how: Any) -> Any:
    how = {"antialias": True, "progress": False, "background": background} | how
    return np.clip(moit.render(scene, "sorted", SIZE, camera=camera, **how)[..., :3], 0, 1)


def pictures() -> dict[str, Any]:
    turbulence, rolls = (
        moit.scenes.lines(name, 1200) for name in ("turbulence-lines", "convection-lines")
    )
    turn = np.linspace(0, 30, 900)
    helix = np.stack([0.75 * np.cos(turn), 0.05 * turn - 0.2, 0.75 * np.sin(turn)], axis=1)
    wire = moit.Lines(helix, radius=0.02, color=(0.1, 0.35, 0.8), alpha=0.8, shape="tube")
    fan = [
        moit.Lines([[0, 0, 0], [np.cos(a), np.sin(a), 0]], pixels=1.5, color=(0, 0, 0))
        for a in np.linspace(0, 2 * np.pi, 40, endpoint=False)
    ]
    star = moit.Mesh([[0.2, -1, 0], [1, -0.6, 0], [0.7, -0.1, 0]], [[0, 1, 2]], (0.7, 0.1, 0.1))
    front = moit.Camera((0, 0, 3), fov_y=0.75)
    edges = [
        drawn([*fan, star], front, (1, 1, 1), antialias=smooth)[100:220, 240:330]
        for smooth in (False, True)
    ]
    return {
        "points as spheres, opacity by height": drawn(
            spheres(4000, radius=0.035, shape="sphere"), VIEW, (1, 1, 1)
        ),
        "tubes, opacity by vorticity": drawn(
            turbulence.lines, turbulence.camera, turbulence.background
        ),
        "tubes, opacity by speed": drawn(rolls.lines, rolls.camera, rolls.background),
        "a grid as a cloud": drawn(cloud(64), VIEW, SKY),
        "a pot, a wire and a cloud in one picture": drawn(
            [*pot(), wire, cloud(48, (-0.2, -0.35, -1.2))], VIEW, SKY
        ),
        "edges without and with antialias": np.concatenate(edges, axis=1),
    }


def draw(named: dict[str, Any]) -> Figure:
    figure, axes = plt.subplots(2, 3, figsize=(10, 5.2), layout="constrained")
    for axis, (title, image) in zip(axes.ravel(), named.items(), strict=True):
        shown = np.where(image <= 0.0031308, 12.92 * image, 1.055 * image ** (1 / 2.4) - 0.055)
        axis.imshow(shown, interpolation="nearest", aspect="equal")
        axis.set_title(title, fontsize=9)
        axis.set_axis_off()
    return figure


def costs(threads: int) -> list[str]:
    """Rows of a table: what is drawn, fragments, and seconds without and with antialias."""
    turbulence = moit.scenes.lines("turbulence-lines", 1000)
    ribbons = turbulence.lines
    ribbons = moit.Lines(
        ribbons.positions,
        ribbons.first,
        0.006,
        np.concatenate([ribbons.color, ribbons.alpha[:, None]], axis=1),
    )
    ship = moit.scenes.meshes("ship-like")
    million = {shape: spheres(1_000_000, pixels=3, shape=shape) for shape in ("disc", "sphere")}
    cases = [
        ("1,000,000 discs, 3 pixels wide", million["disc"], VIEW),
        ("1,000,000 spheres, 3 pixels wide", million["sphere"], VIEW),
        (f"ribbons, {len(ribbons.positions):,} points", ribbons, turbulence.camera),
        (f"tubes, {len(ribbons.positions):,} points", turbulence.lines, turbulence.camera),
        ("a grid of 128 x 128 x 128", cloud(128), VIEW),
        ("the triangles of `ship-like`", ship.meshes, ship.camera),
    ]
    rows = []
    for name, scene, camera in cases:
        told = []
        for smooth in (False, True):
            if smooth and isinstance(scene, moit.Volume):
                told.append("")
                continue
            start = time.process_time()
            f = moit.rasterize(
                scene, camera, COST_SIZE, antialias=smooth, threads=threads, progress=False
            )
            told.append(f"{len(f) / 1e6:.2f} M, {time.process_time() - start:.2f} s")
        rows.append(f"| {name} | {told[0]} | {told[1]} |")
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--threads", type=int, default=2)
    threads = parser.parse_args().threads
    with replacing(HERE / "primitives.png") as part:
        draw(pictures()).savefig(part, dpi=110, format="png")
    lines = [
        TEXT,
        "",
        f"Fragments and seconds of `moit.rasterize` at {COST_SIZE[0]} x {COST_SIZE[1]}, by "
        "`python docs/primitives.py`. Seconds are those of processors, of all threads together, "
        "and hang on the machine.",
        "",
        "| what | middles of pixels | antialias |",
        "|---|---|---|",
        *costs(threads),
    ]
    write_text(HERE / "primitives.md", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
