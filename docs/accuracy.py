"""Prints the tables of README's "How exact": `python docs/accuracy.py [GOLDEN_FOLDER]`.

GOLDEN_FOLDER holds problems.npz and power4.npz to trig4.npz: rays, their moments, and the exact
reconstruction in 80 digits. Without it only the second table is printed.
"""

import sys
from pathlib import Path

import numpy as np

import moit

COUNTS = (4, 6, 8)
NAMES = (*(f"power{count}" for count in COUNTS), "trig2", "trig3", "trig4")


def golden(folder: Path) -> None:
    problems = np.load(folder / "problems.npz")
    z = problems["eval_depth"]
    print("|T - truth| at beta 0.25 and the published bias, for the same float32 moments")
    print(
        f"{'':8} {'dtype':8} {'NaN':>4} {'99 %':>8} {'99.9 %':>8} {'largest':>8}   published 99.9 %"
    )
    for name in NAMES:
        data = np.load(folder / f"{name}.npz")
        b0 = data["b0"].astype(np.float64)
        share = data["truth_A_lower"] + 0.25 * data["truth_w0"]
        truth = np.exp(-b0[:, None] * share)
        published = np.nanquantile(np.abs(data["reference_T"] - truth), 0.999)
        technique = moit.technique(f"{name}(bias={float(data['bias'])})")
        for dtype in (np.float32, np.float64):
            b = data["b"].astype(np.result_type(dtype, data["b"].dtype))
            arrays = (data["b0"].astype(dtype), b, z.astype(dtype))
            T = moit.moments.transmittance(technique, *arrays)
            error = np.abs(T - truth)
            figures = " ".join(f"{x:8.1e}" for x in np.quantile(error, (0.99, 0.999, 1)))
            nans = np.isnan(T).sum()
            print(f"{name:8} {np.dtype(dtype).name:8} {nans:4} {figures}   {published:.1e}")


def surfaces(pixels: int, count: int, rng: np.random.Generator) -> moit.Fragments:
    """Surfaces at least .05 of the range apart, alpha .05 to .9, in random order."""
    room = 1 - 0.05 * (count - 1)
    depth = np.sort(rng.random((pixels, count)), axis=1) * room + 0.05 * np.arange(count)
    depth = rng.permuted(1 + depth, axis=1)
    offsets = np.arange(pixels + 1) * count
    alpha = rng.uniform(0.05, 0.9, depth.size)
    return moit.Fragments(offsets, depth.ravel(), alpha, depth_range=(1, 2))


def few_surfaces() -> None:
    print("exclude_self, surfaces at least .05 of the range apart: |T - exact|, 99 % of fragments")
    print(f"{'':8} {'surfaces':>8} {'float64':>9} {'float32':>9} {'float32':>9} {'float32':>9}")
    print(f"{'':8} {'':>8} {'bias 0':>9} {'bias 0':>9} {'default':>9} {'published':>9}")
    rng = np.random.default_rng(5)
    for count in COUNTS:
        for n in range(1, count // 2 + 2):
            f = surfaces(10_000, n, rng)
            exact = moit.transmittance(f, "sorted")
            cells = []
            for dtype, bias in (("f8", 0.0), ("f4", 0.0), ("f4", None), ("f4", "published")):
                technique = moit.PowerMoments(count, exclude_self=True, bias=bias)
                error = np.abs(moit.transmittance(f, technique, dtype=dtype) - exact)
                cells.append(f"{np.quantile(error, 0.99):9.1e}")
            name = f"power{count}"
            print(f"{name:8} {n:8} {' '.join(cells)}")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        golden(Path(sys.argv[1]))
        print()
    few_surfaces()
