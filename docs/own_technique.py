"""A technique of one's own, twice: in NumPy, and as one file of GLSL.

    python docs/own_technique.py

Two numbers a pixel: its total absorbance and the mean of where that lies between the nearest (0)
and the farthest depth (1). Of all powers of that place one has this mean, and its share of the
absorbance is taken to lie in front. Crude, and cheap.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

import moit

PASS = Path(__file__).with_suffix(".comp.glsl")


@dataclasses.dataclass(frozen=True)
class MeanPlace(moit.PythonTechnique):
    """In NumPy. bits : 32, or 16: half floats, rounded after every fragment as targets do."""

    bits: int = 32

    @property
    def bits_per_pixel(self):
        return 2 * self.bits

    def gather(self, fragments):
        absorbance = -np.log1p(-np.minimum(fragments.alpha, 0.998))
        near, far = np.log(fragments.depth_range)
        place = np.clip((np.log(fragments.depth) - near) / (far - near), 0, 1)
        numbers = np.stack([absorbance, absorbance * place], axis=1)
        sums = moit.storage.added(fragments, numbers, "half" if self.bits == 16 else None)
        ends = np.broadcast_to([near, far], sums.shape)  # the same for all: no pixel stores them
        return np.concatenate([sums, ends], axis=1)

    def read(self, state, depth, alpha):
        total, weighted, near, far = state.T
        mean = np.clip(weighted / np.maximum(total, 1e-6), 0.01, 0.99)
        place = np.clip((np.log(depth) - near) / (far - near), 0, 1)
        return np.exp(-total * place ** (mean / (1 - mean)))


class MeanPlacePass(moit.PythonTechnique):
    """By a pass on a GPU, or on llvmpipe."""

    bits_per_pixel = 64

    def __init__(self):
        super().__init__("mean-place-pass")

    def transmittance(self, fragments):
        found = np.empty(len(fragments), np.float32)
        if not len(fragments):
            return found
        arrays = (
            fragments.offsets.astype(np.int32),
            fragments.depth.astype(np.float32),
            fragments.alpha.astype(np.float32),
        )
        pixels = len(fragments.counts)
        uniforms = {"pixels": pixels, "range": np.log(fragments.depth_range)}
        with moit.gpu.default_device() as device:
            buffers = {i: device.buffer(one.nbytes, one) for i, one in enumerate(arrays)}
            buffers[3] = device.buffer(found.nbytes)
            device.dispatch(
                device.program(PASS), (-(-pixels // 64), 1, 1), buffers=buffers, uniforms=uniforms
            )
            buffers[3].read(found)
        return found


def main() -> None:
    print(moit.check_technique(MeanPlace(), progress=False))
    print(
        moit.compare(
            "smoke",
            [MeanPlace(), MeanPlace(16), MeanPlacePass(), "power4"],
            progress=False,
            repeat=1,
        )
    )


if __name__ == "__main__":
    main()
