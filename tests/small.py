"""Small fragments that several suites share."""

import os
import pickle
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


def out_of_a_message(thing, by=1, is_written_over=False):
    """What a pickle gives back whose arrays lie in a message of several things, where they begin
    anywhere, and which may be written over afterwards."""
    pieces, moved = [], []
    said = pickle.dumps(thing, protocol=5, buffer_callback=pieces.append)
    for one in pieces:
        room = np.empty(len(one.raw()) + 16, np.uint8)
        first = -room.ctypes.data % 8 + by
        moved.append(memoryview(room)[first : first + len(one.raw())])
        moved[-1][:] = one.raw()
    found = pickle.loads(said, buffers=moved)
    for one in moved if is_written_over else ():
        one[:] = b"\xff" * len(one)
    return found
