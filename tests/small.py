"""Small fragments that several suites share."""

import os
from pathlib import Path

import numpy as np

import moit

# Seconds. A process of a few that lasts longer hangs, however much else its machine has to do.
PATIENCE = 900

# For processes that start in another folder: the moit that this one imported.
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(moit.__file__).parent.parent)}


def some_fragments(height=24, width=32, most=5, seed=0, color=True, dtype=None):
    """Random fragments, up to `most` a pixel, some pixels empty."""
    random = np.random.default_rng(seed)
    counts = random.integers(0, most + 1, height * width)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    count = int(offsets[-1])
    return moit.Fragments(
        offsets,
        random.uniform(1, 10, count).astype(np.float32),
        random.uniform(0.05, 0.9, count).astype(np.float32),
        random.uniform(0, 1, (count, 3)).astype(np.float32) if color else None,
        shape=(height, width),
        dtype=dtype,
    )
