"""What PerPixel takes and how far off it is: `python benchmarks/per_pixel.py [-s SCENE]...`.

For every scene, max_error and way to choose: bits a pixel, beside sorting and the cheapest single
technique of moit.techniques() that is as good on 99.9 % of pixels; errors of pixels that were not
tried; and seconds of whole composites. Then from how many fragments a pixel on sorting takes longer
than other techniques. Prints, never judges.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from functools import partial

import numpy as np

import moit
from moit import _core
from moit.per_pixel.plan import SORTED_BITS
from moit.system.environment import processors

SCENES = ("mixed", "teapots", "cloud", "hair", "panes")
COUNTS = (2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)
BESIDE = (
    "wboit-eq7",
    "power4(exclude_self=True,overestimation=0.4)",
    "trig4(exclude_self=True,overestimation=0.5)",
)


def seconds_of(call: Callable[[], object], repeat: int) -> float:
    """The median."""
    seconds = []
    for _ in range(repeat):
        start = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def off(f: moit.Fragments, image: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """(P,) the largest difference of a pixel's channels."""
    return np.abs(image - exact).max(axis=2).ravel()


def cheapest(
    errors: dict[str, np.ndarray], bits: dict[str, float], max_error: float
) -> tuple[str, float]:
    """The single technique that takes least of those that are good enough on 99.9 % of pixels."""
    good = [name for name, error in errors.items() if (error <= max_error).mean() >= 0.999]
    name = min(good, key=bits.__getitem__)
    return name, bits[name]


def print_scene(name: str, f: moit.Fragments, max_errors: list[float], repeat: int) -> None:
    exact = moit.composite(f, "sorted", dtype=np.float64)
    counts = _core.pixel_facts(f, True, processors())[:, 0]
    bits = {"sorted": float(SORTED_BITS * counts.mean())}
    errors = {"sorted": off(f, moit.composite(f, "sorted"), exact)}
    for one in moit.techniques():
        if one.bits_per_pixel is not None:
            errors[str(one)] = off(f, moit.composite(f, one), exact)
            bits[str(one)] = one.bits_per_pixel
    sorting = seconds_of(lambda: moit.composite(f, "sorted"), repeat)
    for max_error in max_errors:
        single, single_bits = cheapest(errors, bits, max_error)
        alone = seconds_of(partial(moit.composite, f, single), repeat)
        for certify in (False, True):
            technique = moit.PerPixel(max_error, certify=certify)
            choice = moit.choose(f, technique)
            taken = seconds_of(partial(moit.composite, f, technique), repeat)
            measured = choice.measured
            print(
                f"{name:10}{max_error * 255:6.1f}  {'proved' if certify else 'predicted':10}"
                f"{choice.bits_per_pixel:8.1f}{bits['sorted']:8.1f}{single_bits:8.1f}"
                f"{1 - choice.bits_per_pixel / single_bits:7.0%}  {single:16}"
                f"{choice.beyond:8.3%}{measured['p999'] * 255:8.2f}{measured['worst'] * 255:8.2f}"
                f"{choice.predicted['p999'] * 255:8.2f}"
                f"{taken * 1e3:9.0f}{sorting * 1e3:8.0f}{alone * 1e3:8.0f}",
                flush=True,
            )


def print_crossover(repeat: int, fragments: int = 1 << 21) -> None:
    """Random fragments, the same number in each pixel."""
    rng = np.random.default_rng(0)
    depth = rng.uniform(1, 100, fragments).astype(np.float32)
    alpha = rng.uniform(0, 0.5, fragments).astype(np.float32)
    color = rng.random((fragments, 3), dtype=np.float32)
    techniques = ("sorted", *BESIDE)
    print(f"\n{fragments:,} fragments: million a second by how many a pixel has")
    print(f"{'':10}" + "".join(f"{name.partition('(')[0]:>12}" for name in techniques))
    crossed: dict[str, int] = {}
    for count in COUNTS:
        f = moit.Fragments(np.arange(0, fragments + 1, count), depth, alpha, color)
        rates = [
            fragments / seconds_of(partial(moit.composite, f, one), repeat) / 1e6
            for one in techniques
        ]
        for name, rate in zip(BESIDE, rates[1:], strict=True):
            if rate > rates[0]:
                crossed.setdefault(name, count)
            else:
                crossed.pop(name, None)
        print(f"{count:10}" + "".join(f"{rate:12.1f}" for rate in rates), flush=True)
    for name in BESIDE:
        where = f"from {crossed[name]} a pixel on" if name in crossed else "never, up to 1024"
        print(f"sorting is slower than {name}: {where}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, nargs=2, default=(640, 360), metavar=("W", "H"))
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--max-error", type=float, nargs="*", default=[2, 8], metavar="STEPS")
    parser.add_argument("-s", dest="scenes", action="append", metavar="NAME")
    chosen = parser.parse_args()
    info = moit.info()
    print(f"{info['processor']}, {info['instruction set in use']}, {processors()} processors")
    print("bits a pixel; errors in steps of 1/255, of pixels that were not tried; milliseconds")
    print(
        f"{'scene':10}{'error':>6}  {'':10}{'bits':>8}{'sorted':>8}{'single':>8}{'less':>7}  "
        f"{'which':16}{'beyond':>8}{'99.9 %':>8}{'worst':>8}{'said':>8}{'ms':>9}{'sorted':>8}"
        f"{'single':>8}"
    )
    for name in chosen.scenes or SCENES:
        f = moit.scenes.load(name, size=tuple(chosen.size), seed=chosen.seed)
        print_scene(name, f, [steps / 255 for steps in chosen.max_error], chosen.repeat)
    print_crossover(chosen.repeat)


if __name__ == "__main__":
    main()
