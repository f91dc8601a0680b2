"""Golden data: inputs with answers that were computed at 80 digits."""

from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent / "data"


def golden(name: str) -> dict[str, np.ndarray]:
    """The arrays of one file."""
    with np.load(FOLDER / f"{name}.npz") as data:
        return dict(data)
