"""Prints how far passes on a GPU are from the core: `python docs/gpu_agreement.py`.

For every technique, over some scenes and random fragments: the share of numbers
whose bits differ and the greatest difference, of pictures (a difference relative to values above 1)
and of transmittances, both of exact passes; and the greatest of transmittances by texts for
engines, where there are. What a line says hangs on the renderer, which the first line names.
"""

import argparse

import numpy as np

import moit
from moit.gpu import default_device
from moit.gpu.passes import has_engine_text

BACKGROUND = (0.2, 0.3, 0.4)


def inputs(size: tuple[int, int]) -> list[moit.Fragments]:
    random = np.random.default_rng(0)
    counts = random.integers(0, 30, 4000)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    n = int(offsets[-1])
    hard = moit.Fragments(
        offsets,
        np.exp(random.uniform(0, 9, n)),
        random.choice([0, 1e-6, 0.01, 0.5, 0.999, 1], n),
        random.random((n, 3)),
        dtype=np.float32,
    )
    return [hard, *(moit.scenes.load(name, size=size) for name in ("mixed", "hair", "cloud"))]


def differences(ours: np.ndarray, theirs: np.ndarray) -> tuple[int, int, float]:
    """Numbers that differ, numbers, and the greatest difference."""
    far = abs(ours.astype(np.float64) - theirs) / np.maximum(1, abs(theirs))
    return int((ours != theirs).sum()), ours.size, float(far.max(initial=0))


def shown(found: list[tuple[int, int, float]]) -> str:
    different, numbers = (sum(one[i] for one in found) for i in range(2))
    return f"{100 * different / numbers:8.4f} % {max(one[2] for one in found):9.2g}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, nargs=2, default=(160, 90), metavar=("W", "H"))
    size = tuple(parser.parse_args().size)
    device = default_device()
    print(f"{device.renderer}, {device.info['version']}; against moit's core in float32")
    print(f"{'':30}{'pictures':>21}{'transmittances':>21}{'engines':>11}")
    scenes = inputs(size)
    for technique in moit.techniques():
        pictures, shares, engines = [], [], 0.0
        for f in scenes:
            pictures.append(
                differences(
                    moit.composite(f, technique, background=BACKGROUND, device=device, exact=True),
                    moit.composite(f, technique, background=BACKGROUND),
                )
            )
            truth = moit.transmittance(f, technique)
            exact = moit.transmittance(f, technique, device=device, exact=True)
            shares.append(differences(exact, truth))
            if has_engine_text(technique):
                found = moit.transmittance(f, technique, device=device)
                engines = max(engines, differences(found, truth)[2])
        last = f"{engines:11.2g}" if engines else ""
        print(f"{technique!s:30}{shown(pictures):>21}{shown(shares):>21}{last}", flush=True)


if __name__ == "__main__":
    main()
