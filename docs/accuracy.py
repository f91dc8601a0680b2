"""Writes docs/accuracy.md: `python docs/accuracy.py [GOLDEN_FOLDER]`; prints it, too.

GOLDEN_FOLDER holds problems.npz and power4.npz to trig4.npz: rays, their moments, and the exact
reconstruction in 80 digits. Without it the first table is left out, and nothing is written.
"""

import sys
from pathlib import Path

import numpy as np

import moit
from moit.system.files import write_text

COUNTS = (4, 6, 8)
NAMES = (*(f"power{count}" for count in COUNTS), "trig2", "trig3", "trig4")
LAB = ("power4", "power6", "power8", "trig2", "trig3", "trig4", "fourier15", "mlab4")
SURPRISES = """\
- With the same float32 moments, factors in double and sums of positive terms alone give five more
  digits than published float32 code: what was lost was lost in reconstruction.
- The published bias is not what keeps results good, but what keeps float32 factorisations from
  failing. A tenth of it does where factors are made in double, and errs less. Not so where a GPU's
  blending adds up float32: the order of triangles showed, by up to .15 in single pixels, and drawn
  moments have the published bias again.
- For words of 16 bits the published bias is not always enough: `power4-16` needs up to five times
  as much in `mixed`. No NaN comes of it, as pivots that are all rounding end the rule early.
- Two surfaces nearer than about 1e-5 of the depth range are one to any moments in float32, and at
  1e-3 to words of 16 bits.
- Ten thousand layers are no hard case for moments in float32; in words they are lost.
"""


def row(*cells: object) -> str:
    return f"| {' | '.join(map(str, cells))} |"


def header(*cells: object) -> list[str]:
    return [row(*cells), "|" + "---|" * len(cells)]


def golden(folder: Path) -> list[str]:
    problems = np.load(folder / "problems.npz")
    z = problems["eval_depth"]
    lines = header("", "dtype", "NaN", "99 %", "99.9 %", "greatest", "published code, 99.9 %")
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
            figures = [f"{x:.1e}" for x in np.quantile(error, (0.99, 0.999, 1))]
            kind = np.dtype(dtype).name
            lines.append(row(f"`{name}`", kind, np.isnan(T).sum(), *figures, f"{published:.1e}"))
    return lines


def surfaces(pixels: int, count: int, rng: np.random.Generator) -> moit.Fragments:
    """Surfaces at least .05 of the range apart, alpha .05 to .9, in random order."""
    room = 1 - 0.05 * (count - 1)
    depth = np.sort(rng.random((pixels, count)), axis=1) * room + 0.05 * np.arange(count)
    depth = rng.permuted(1 + depth, axis=1)
    offsets = np.arange(pixels + 1) * count
    alpha = rng.uniform(0.05, 0.9, depth.size)
    return moit.Fragments(offsets, depth.ravel(), alpha, depth_range=(1, 2))


def few_surfaces() -> list[str]:
    lines = header(
        "",
        "surfaces",
        "float64, bias 0",
        "float32, bias 0",
        "float32, default",
        "float32, published",
    )
    rng = np.random.default_rng(5)
    for count in COUNTS:
        for n in range(1, count // 2 + 2):
            f = surfaces(10_000, n, rng)
            exact = moit.transmittance(f, "sorted")
            cells = []
            for dtype, bias in (("f8", 0.0), ("f4", 0.0), ("f4", None), ("f4", "published")):
                technique = moit.PowerMoments(count, exclude_self=True, bias=bias)
                error = np.abs(moit.transmittance(f, technique, dtype=dtype) - exact)
                cells.append(f"{np.quantile(error, 0.99):.1e}")
            lines.append(row(f"`power{count}`", n, *cells))
    return lines


def lab() -> list[str]:
    """The worst setting of each family's dial."""
    report = moit.stability(LAB, progress=False)
    families = list(dict.fromkeys(one["family"] for one in report.rows))
    lines = header("", "precision", *(f"`{family}`" for family in families))
    labels = dict.fromkeys((one["technique"], one["precision"]) for one in report.rows)
    for technique, precision in labels:
        cells = []
        for family in families:
            own = [
                one["own_p99"]
                for one in report.rows
                if (one["technique"], one["precision"], one["family"])
                == (technique, precision, family)
                and one["own_p99"] is not None
            ]
            cells.append(f"{max(own):.0e}" if own else "")
        lines.append(row(f"`{technique}`", precision, *cells))
    return lines


def kept(title: str) -> str:
    """A section of the page as it stands, which another program measures (tests/exhaustive.py)."""
    text = Path(__file__).with_suffix(".md").read_text(encoding="utf-8")
    _, found, rest = text.partition(f"\n{title}\n")
    return f"{title}\n{rest.partition(chr(10) + '## ')[0]}".rstrip() if found else ""


def main() -> None:
    known = len(sys.argv) > 1
    parts = [
        "# How exact",
        "Made by `python docs/accuracy.py GOLDEN_FOLDER`. What is called exact here is an answer "
        "in 80 digits or, of fragments, their product in double.",
        "## Reconstruction",
        "|T - truth| at beta 0.25 and the published bias, of 4,000 hard rays, for the same float32 "
        "moments.",
        "\n".join(golden(Path(sys.argv[1]))) if known else "",
        "## Few surfaces",
        "`exclude_self=True`, surfaces at least .05 of the range apart: |T - exact|, 99 % of "
        "fragments.",
        "\n".join(few_surfaces()),
        "## Hard cases",
        "By family of `moit stability`, at the worst setting of its dial: how far 99 % of T are "
        "from the same technique in unlimited precision. Empty: not known, or nothing is asked.",
        "\n".join(lab()),
        kept("## Elementary functions"),
        "## What surprised us",
        SURPRISES.rstrip(),
    ]
    text = "\n\n".join(part for part in parts if part) + "\n"
    print(text)
    if known:
        write_text(Path(__file__).with_suffix(".md"), text)


if __name__ == "__main__":
    main()
