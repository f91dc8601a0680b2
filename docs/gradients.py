"""Writes gradients.md: how exact derivatives are, and what they cost beside the answer.

python docs/gradients.py [--rays 4] [--pixels 40000]
"""

import argparse
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from mpmath import mp, mpf

import moit
from moit import gradients
from moit.benching.timing import fragments_of
from moit.gradients import moment_bounds
from moit.system.files import write_text

HERE = Path(__file__).parent
# The oracle of the tests lies beside docs/, in no package: its folder is known only from here on,
# which is why these imports stand below a statement.
sys.path.insert(0, str(HERE.parent))

from tests.oracle import power  # noqa: E402
from tests.oracle.hard_rays import HardRay, hard_rays  # noqa: E402

MOST = 12  # fragments of a ray: each costs a root in 80 digits for each step
BIASES = (None, 1e-6)
TIMED = (
    *("sorted", "hybrid4", "wboit", "power4", "power6", "power8", "trig3"),
    *("moment-transparency(passes=2)", "neural-bounded", "fourier15(bits=32)", "wavelet16"),
    *("transmittance-function-map(bits=32)", "slices64"),
)


def loss(ray: HardRay, technique: moit.PowerMoments, bias: float, seed, moves, last=()) -> mpf:
    """The sum of seed and transmittance where depth and alpha have moved so, and each moment by
    `last` half last digits of a double."""
    depth = [mpf(float(x)) + d for x, d in zip(ray.depth, moves[0], strict=True)]
    a = [
        -mp.log1p(-min(mpf(float(x)) + d, mpf(technique.max_alpha)))
        for x, d in zip(ray.alpha, moves[1], strict=True)
    ]
    b0 = mp.fsum(a)
    powers = range(1, technique.count + 1)
    b = [mp.fsum(x * z**k for x, z in zip(a, depth, strict=True)) / b0 for k in powers]
    for k, digits in enumerate(last):
        b[k] += mpf(float(digits)) * mpf(2) ** -53 * abs(b[k])
    rest = power.biased(b, bias)
    beta = technique.overestimation
    return mp.fsum(
        mpf(float(s)) * power.transmittance(rest, b0, z, beta)
        for s, z in zip(seed, depth, strict=True)
    )


def derivative(ray, technique, bias, seed, way, which, last=()) -> float:
    """Of the loss, as depth (which 0) or alpha (1) moves so."""
    ends = []
    for step in (mpf(10) ** -25, -(mpf(10) ** -25)):
        moves = [[mpf(0)] * len(way), [mpf(0)] * len(way)]
        moves[which] = [step * mpf(float(x)) for x in way]
        ends.append(loss(ray, technique, bias, seed, moves, last))
    return float((ends[0] - ends[1]) / (2 * mpf(10) ** -25))


def moved(asked: tuple, last, exact: float) -> float:
    """How far; 0 where no measure has such moments."""
    try:
        return abs(derivative(*asked, last) - exact)
    except ValueError:
        return 0.0


def errors(rays: list[HardRay], technique: moit.PowerMoments, dtype: str) -> Iterator[list[float]]:
    """Of each ray the error of derivatives along a random direction of depth and of alpha, over the
    sum of what its parts add up to; and in double with its own bias how far random last digits of
    moments move them."""
    bias, rng = technique.bias_for(dtype), np.random.default_rng(0)
    random = np.random.default_rng(1)
    for ray in rays:
        f = moit.Fragments(
            [0, len(ray.depth)], ray.depth, ray.alpha, depth_range=(-1, 1), dtype=dtype
        )
        seed, way = rng.normal(size=(2, len(ray.depth))).astype(np.float32)
        found = gradients.transmittance(f, technique)[1](seed)
        row, moves_of = [], []
        with mp.workdps(60):
            for which, got in enumerate((found.depth, found.alpha)):
                asked = (ray, technique, bias, seed, way, which)
                exact, parts = derivative(*asked), got.astype(float) * way
                # what no part exceeds is measured by 1e-3 of the loss's own size
                size = max(float(np.abs(parts).sum()), abs(exact), 1e-3)
                row.append(abs(float(parts.sum()) - exact) / size)
                if dtype == "float64" and technique.bias is None:
                    digits = random.uniform(-1, 1, technique.count)
                    moves_of.append(moved(asked, digits, exact) / size)
            row += moves_of
        yield row


def accuracy(of_each_kind: int) -> Iterator[str]:
    rays = [ray for ray in hard_rays(2, of_each_kind) if ray.kind != "same depth"]
    rays = [HardRay(r.kind, r.depth[:MOST], r.alpha[:MOST]) for r in rays]
    rays = [HardRay(r.kind, *_apart(r)) for r in rays]
    rays = [r for r in rays if r.kind != "alpha at its maximum"]
    yield f"{len(rays)} rays"
    for dtype in ("float64", "float32"):
        for bias in BIASES:
            for count in (4, 6, 8):
                technique = moit.PowerMoments(count, warp="none", normalize=False, bias=bias)
                found = np.array(list(errors(rays, technique, dtype)))
                cells = [
                    f"{np.quantile(one, q):.0e}" for one in found.T[:2] for q in (0.5, 0.9, 0.999)
                ]
                cells += [f"{np.quantile(one, 0.999):.0e}" for one in found.T[2:]] or ["", ""]
                known = "default" if bias is None else f"{bias:.0e}"
                yield f"| `power{count}` | {dtype} | {known} | {' | '.join(cells)} |"


def _apart(ray: HardRay) -> tuple[np.ndarray, np.ndarray]:
    """Without fragments at a depth that another has: there a derivative has two sides."""
    depth, first = np.unique(ray.depth, return_index=True)
    return depth, ray.alpha[first]


def costs(pixels: int) -> Iterator[str]:
    rng = np.random.default_rng(0)
    offsets = np.concatenate([[0], np.cumsum(rng.integers(0, 25, pixels))])
    n = offsets[-1]
    numbers = rng.uniform(1, 6, n), rng.uniform(0.05, 0.8, n), rng.uniform(0, 1, (n, 3))
    for dtype in ("float32", "float64"):
        f = moit.Fragments(offsets, *numbers, depth_range=(1, 6), dtype=dtype)
        for name in TIMED:
            forward, both = [], []
            for _ in range(9):
                begin = time.process_time()
                image = moit.composite(f, name, threads=1)
                middle = time.process_time()
                image, pullback = gradients.composite(f, name, threads=1)
                pullback(image)
                forward.append(middle - begin)
                both.append(time.process_time() - middle)
            alone, all_ = min(forward) / n * 1e9, min(both) / n * 1e9
            yield f"| `{name}` | {dtype} | {alone:.0f} | {all_:.0f} | {all_ / alone:.1f} |"


LAYOUTS = ("16 a pixel", "geometric, mean 4")


def ratios(names: tuple[str, ...]) -> str:
    """How many times as long as the picture alone picture and pullback take, in float32."""
    told = []
    for layout in LAYOUTS:
        f = fragments_of(layout, 400_000)
        each = []
        for name in names:
            alone, both = [], []
            for _ in range(25):  # in turns, as machines are busy now and then
                begin = time.process_time()
                moit.composite(f, name, threads=1)
                middle = time.process_time()
                image, pullback = gradients.composite(f, name, threads=1)
                pullback(image)
                alone.append(middle - begin)
                both.append(time.process_time() - middle)
            each.append(f"{min(both) / min(alone):.1f}")
        told.append(f"{', '.join(each[:-1])} and {each[-1]} ({layout})")
    return "; ".join(told)


RIVALS = "100,000 rays of 4, 6, 8 moments in float32, forward and backward, took"


def rivals() -> str:
    """Against diffmoments, where that is installed; else what the page has said."""
    try:
        import diffmoments.np as theirs
    except ImportError:
        before = (HERE / "gradients.md").read_text(encoding="utf-8")
        found = re.search(re.escape(RIVALS).replace(r"\ ", r"\s+") + r"[^.]*", before)
        return found[0] if found else f"{RIVALS} times that are unknown"
    rng, rays, times = np.random.default_rng(0), 100_000, []
    for count in (4, 6, 8):
        place, mass = rng.uniform(-1, 1, (6, rays)), rng.uniform(0.1, 1, (6, rays))
        rows = np.stack([(mass * place**k).sum(0) for k in range(count + 1)]).astype(np.float32)
        at = rng.uniform(-1, 1, rays).astype(np.float32)
        least = {}
        for library in (theirs, moment_bounds) * 7:
            for _ in range(4):  # the first finds memory as the other has left it
                begin = time.process_time()
                _, context = library.compute_moment_bounds(
                    rows, at, 6e-5, 0.25, return_backward_context=True
                )
                library.compute_moment_bounds_backward(context, np.ones(rays, np.float32))
                spent = time.process_time() - begin
                least[library] = min(spent, least.get(library, spent))
        times.append(f"{least[theirs] / least[moment_bounds]:.0f}")
    return (
        f"{RIVALS}\n  {times[0]}, {times[1]} and {times[2]} times as much processor time there, "
        "on one thread each"
    )


def page(arguments: argparse.Namespace) -> str:
    count, *rows = accuracy(arguments.rays)
    how = f"--rays {arguments.rays} --pixels {arguments.pixels}"
    return "\n".join(
        [
            "# Derivatives",
            "",
            f"Made by `python docs/gradients.py {how}`.",
            "",
            TEXT.format(rivals=rivals(), ratios=ratios(("power4", "power6", "power8"))),
            "## How exact",
            "",
            f"Derivatives of transmittances along a random direction of all depths, and of all "
            f"alphas, against differences in 60 digits of the technique as it is defined, with its "
            f"bias. {count} of the kinds of `tests/oracle/hard_rays.py`, of at most {MOST} "
            f"fragments at depths that differ; median, 90 % and 99.9 % of rays. Errors are over "
            f"the sum of sizes of what adds up.",
            "",
            "| technique | numbers | bias | depth: median | 90 % | 99.9 % "
            "| alpha: median | 90 % | 99.9 % | last digits of moments: depth | alpha |",
            "|---|---|---|---|---|---|---|---|---|---|---|",
            *rows,
            "",
            LIMITS,
            "## What they cost",
            "",
            f"Nanoseconds a fragment on one thread, {arguments.pixels} pixels of 0 to 24 "
            "fragments: the picture alone, and the picture with its pullback.",
            "",
            "| technique | numbers | picture | with pullback | times |",
            "|---|---|---|---|---|",
            *costs(arguments.pixels),
            "",
            CHAINS,
        ]
    )


TEXT = """\
`moit.gradients.composite(f, technique)` gives the picture and a pullback: from the derivatives of a
loss by the picture to those by depth, alpha, colour, transmission and background. `transmittance`
and `total_transmittance` do the same for theirs.

```python
image, pullback = moit.gradients.composite(f, "power4", background=behind)
d = pullback(image - target)  # of half the squared distance
alpha = alpha - rate * d.alpha
```

- There are derivatives of `sorted`, `unsorted`, `weighted-sum`, `weighted-average`, `wboit` with
  each named weight; power and trigonometric moments, Moment Transparency in one and two passes,
  `neural-bounded`, `neural`, `neural-slices` and `dfa` (of their weights, too:
  `Gradients.network`), Fourier opacity, transmittance function maps, wavelets, `slices` (what
  rounding to steps adds stays as it is; of `neural-slices` to a pixel's ends, too, as does between
  which slices a network sees a fragment, where its answer jumps);
  depth peeling, the k-buffer, `hybrid`, and `front` over its tails (which fragments are kept
  stays); `stochastic`, whose samples estimate those of `sorted`. State of 16 bits (words, half
  floats, targets) and keys of 32 move as if they held all digits. Slices within what moments
  prove move as these where they are at a bound. Others are refused with a sentence that says why,
  and what is nearest that has some. Not there yet: volumes, Gaussians and emission; the GPU.
- With `resolution=` states are means of blocks of pixels, of which pixels read the four around
  them: power and trigonometric moments, Fourier opacity, wavelets, function maps and bounded
  networks have derivatives then, with either `total`. An image is gone through twice: pixels give
  what they are read by to blocks, a polynomial around the block's mean depth, and fragments take it
  from there. Shares that go by opaque surfaces (`upsampling="depth-aware"`) stay as they are, as
  these do. Moment Transparency of blocks, whose moments are of the pixel at their middle or behind
  the farthest of their surfaces, and slices of blocks are refused.
- `composite_jvp` and `total_transmittance_jvp` go forwards: from how fragments and the background
  move to how pictures and totals do, of any technique that has derivatives, for four pullbacks, or
  one.
- `moit.train` goes down the same slopes, but by matrices over features that it has once: a test
  holds both texts together.
- What counts of a node in the wrapping zone of trigonometric moments changes with the node, so what
  is in front is no optimum there. The polynomial that has the counting function's value at all
  nodes, and its slope at all but the one at z, gives the derivatives all the same.
- `transmittance` takes depths, for curves. `moments_transmittance` and `moments_bounds` are of
  moments by themselves, and `moit.gradients.moment_bounds` has them as users of diffmoments call
  them: {rivals}.
  A ray's rule is made once, and slopes are made with the answer; up to 4
  moments of floats, with a bias of 1e-6 at least, all of it by one loop. With little bias both say
  the same; moit mixes another safe distribution in. Of a thousand rays, Python takes longer than
  the loop.
- The share of absorbance in front of a depth is the optimum of a linear program, so its derivative
  by the moments is the polynomial that solves the dual. No root is differentiated. Polynomials are
  kept in products of distances from the nodes of the pixel's Gauss rule, not in powers of depth:
  these would lose all digits where fragments lie close together.
- Memory is some two megabytes a thread beside the results, whatever the picture's size. Bits
  are the same for any number of threads and any instruction set. All but the results is double, so
  float32 fragments lose nothing but in the last rounding; of 2 and 4 moments see below.
- In double with less bias than 1e-9, as by default, moments hold too little of fragments that are
  close: pictures and transmittances in front of fragments go back by rules that are sought with
  twice the digits, from the fragments. Curves at depths, and rays of more than a thousand
  fragments, go back by the moments that are stored.
- At kinks derivatives are finite and of one side; the docstring says which.
- What of moments takes a search is found once, for the transmittance and for the way back.
- Pictures and transmittances of 2 and 4 power moments in float32 (bias 1e-8 at least, no coloured
  transmission, the image's range) go back in floats, as twice as many stand in a vector; rules and
  sums are double. Where fragments are few or close, what is read at a depth and what the moments
  move with it take each other away, and floats keep too few digits of what is left: pixels of two
  and three fragments, and others where that is found, go back in double, all of a tile together.
  Of 6 and 8 moments floats keep too few digits where surfaces are close: these go back in double.
- Forward and backward take so many times as long as forward, of 4, 6 and 8 moments in float32, by
  this run: {ratios}. 3.5 was asked.
"""

LIMITS = """\
With the default bias of double, 1e-15, fragments may be nearer to one another than their moments
tell: the last two columns have how far (99.9 % of rays) derivatives move where each moment moves by
a random part of its last digit, in 60 digits. So rules are sought from the fragments there, with
twice the digits. What is left are pairs some millionths of the range apart, among no more fragments
than `power8` has nodes: there steps of the curve and moments that move with them take each other
away, but for what bias leaves. Rays of at most half as many fragments as moments are exact wherever
these lie, so their depth has next to no derivative: what bias leaves of it.
"""

CHAINS = """\
## Through geometry

`moit.gradients.render(scene, camera, size, technique)` goes on to splats (middles, sizes, turns,
opacities, harmonics, of each convention) and to what meshes look like (colours and opacities of
vertices, texels of images); `moit.gradients.rasterize` gives the fragments
and their part of the chain.

```python
image, pullback = moit.gradients.render(splats, camera, (640, 480), "power4", background=behind)
d = pullback(image - target)
means = splats.means - rate * d.means
```

- Of splats each tile is drawn again and its sums are kept by place in the tile's list, so bits are
  those of any number of threads. Beside results memory holds one band of some four million
  fragments and 18 numbers a splat.
- Held to formulas in complex numbers, which lose no digit: within 2e-6 of the sum of the sizes of
  what adds up for 95 % of numbers, and 5e-5 for all. What is left is float32's alpha.
- Which fragments there are stays as it is, and so does the range of depth. Positions of vertices,
  shadows, transmission and thick splats have no derivatives.
- [fitting.ipynb](../notebooks/fitting.ipynb) fits ten thousand splats to a picture by each of six
  techniques; [opacity.ipynb](../notebooks/opacity.ipynb) finds opacities of shells that show what
  is inside.

## In frameworks

`moit.torch` (`pip install 'moit[torch]'`) has `composite`, `transmittance` and
`total_transmittance` of rays as operators of `torch.library`, with shapes for compilers and
derivatives, and `render` of splats; `moit.jax` (`moit[jax]`) has the same as functions with
`custom_vjp`. Samples stand one ray after the other; `offsets`, `packed_info` or `ray_indices` say
which are whose. PyTorch's tensors are read where they are. `opcheck`, `gradcheck` and JAX's
`check_grads` pass.

```python
import moit.torch

image = moit.torch.composite(
    depth, alpha, color, technique="power4", packed_info=packed_info, depth_range=(near, far)
)
image.sum().backward()
```
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=int, default=4, help="of each kind of hard rays")
    parser.add_argument("--pixels", type=int, default=40_000)
    text = page(parser.parse_args())
    write_text(HERE / "gradients.md", text.rstrip("\n") + "\n")
    print(text)


if __name__ == "__main__":
    main()
