"""Golden data beside the checkout: inputs with answers that were computed at 80 digits."""

from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).parents[2] / "shared/data/golden"


def golden(name: str) -> dict[str, np.ndarray]:
    """The arrays of one file; skips the test where the data is absent."""
    path = FOLDER / f"{name}.npz"
    if not path.exists():
        pytest.skip(f"no golden data: {path} is absent")
    with np.load(path) as data:
        return dict(data)
