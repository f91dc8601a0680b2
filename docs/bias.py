"""Prints what bias costs, by kind of ray: `python docs/bias.py`.

Root mean square and largest |T(float32 at a bias) - T(float64 at the least bias)| over fragments:
how far storage in float32 and its bias take the reconstruction from that of unlimited precision.
"""

import dataclasses
from collections.abc import Iterator

import numpy as np

import moit

TECHNIQUES = (
    *(moit.PowerMoments(count) for count in (4, 6, 8)),
    *(moit.TrigonometricMoments(count) for count in (2, 3, 4)),
)
SHARES = (1, 0.1, 0.01, 0.003, 0)  # of the published bias


def kinds(rng: np.random.Generator) -> Iterator[tuple[str, moit.Fragments]]:
    """Rays with depth in [-1, 1]."""

    def rays(
        count: np.ndarray, centre: float, spread: float, alpha: tuple[float, float]
    ) -> moit.Fragments:
        at = np.repeat(rng.uniform(-centre, centre, count.size), count)
        depth = np.clip(at + spread * rng.normal(size=at.size), -1, 1)
        offsets = np.concatenate([[0], np.cumsum(count)])
        return moit.Fragments(
            offsets, depth, rng.uniform(*alpha, at.size), depth_range=(-1, 1), dtype="f4"
        )

    yield "1-4 surfaces", rays(rng.integers(1, 5, 5000), 0, 0.6, (0.2, 0.95))
    yield "5-8 surfaces", rays(rng.integers(5, 9, 5000), 0, 0.6, (0.2, 0.95))
    yield "2-32 fragments", rays(rng.integers(2, 33, 2000), 0, 0.6, (0.1, 0.5))
    yield "3-7 close", rays(rng.integers(3, 8, 5000), 0.9, 0.02, (0.2, 0.9))
    yield "hair", rays(rng.integers(40, 171, 500), 0.9, 0.06, (0.2, 0.2))
    yield "500 fragments", rays(np.full(50, 500), 0, 0.6, (0.05, 0.2))
    yield "nearly opaque", rays(rng.integers(1, 20, 2000), 0, 0.6, (0.99, 0.998))
    yield "nearly clear", rays(rng.integers(1, 20, 2000), 0, 0.6, (1e-4, 1e-3))


def main() -> None:
    heads = " ".join(f"{f'bias x {share}':>17}" for share in SHARES)
    print(f"{'':15} {'':7} {heads} {'default':>17}")
    for name, f in kinds(np.random.default_rng(1)):
        for moments in TECHNIQUES:
            least = dataclasses.replace(moments, warp="none")
            ideal = moit.transmittance(f, least, dtype="f8")
            published = dataclasses.replace(moments, bias="published").bias_for("f4")
            cells = []
            for bias in (*(share * published for share in SHARES), None):
                T = moit.transmittance(f, dataclasses.replace(least, bias=bias))
                error = np.abs(T - ideal)
                cells.append(f"{np.sqrt((error**2).mean()):8.1e} {error.max():8.1e}")
            print(f"{name:15} {moments!s:7} {' '.join(cells)}")


if __name__ == "__main__":
    main()
