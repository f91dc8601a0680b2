"""Pictures of files as the arrays that a Texture takes."""

from __future__ import annotations

import io
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError
from moit.geometry.textures import MOST_SIDE


def decoded(content: bytes | memoryview, where: str) -> NDArray[Any]:
    """(H, W, 3) or (H, W, 4) uint8, or uint16 where a grey picture has 16 bits, of a PNG, JPEG or
    another kind that Pillow reads. Raises MeshError, and ImportError where Pillow is missing."""
    try:
        from PIL import Image
    except ImportError as error:
        raise ImportError("textures need Pillow: pip install 'moit[mesh]' installs it") from error
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # sizes are checked below
            picture = Image.open(io.BytesIO(content))
        if max(picture.size) > MOST_SIDE:
            raise MeshError(
                f"{where}: found {picture.size[0]} x {picture.size[1]} texels; needed at most "
                f"{MOST_SIDE} a side"
            )
        if picture.mode.startswith("I"):
            grey = np.asarray(picture).astype(np.uint16)
            return np.repeat(grey[..., None], 3, axis=2)
        clear = "A" in picture.mode or "a" in picture.mode or "transparency" in picture.info
        return np.asarray(picture.convert("RGBA" if clear else "RGB"))
    except MeshError:
        raise
    except Exception as error:  # Pillow's readers raise anything
        raise MeshError(f"{where}: cannot be read as a picture: {error}") from error
