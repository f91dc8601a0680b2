"""Images on triangles: what they hold, and how they are read between texels and beyond edges."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.checks.arguments import one_of
from moit.checks.arrays import as_array, finite
from moit.checks.unchanging import Unchanging
from moit.reports.pictures import from_srgb

Array = NDArray[Any]

MOST_SIDE = _core.numbers()["MOST_SIDE"]
COLOR_SPACES = ("linear", "srgb")
WRAPS = ("repeat", "mirror", "clamp")  # as csrc/kernels/options.h numbers them
FILTERS = ("nearest", "bilinear", "mipmap")
GREATEST = {np.dtype(np.uint8): 255, np.dtype(np.uint16): 65535}


@dataclasses.dataclass(frozen=True, eq=False)
class Texture(Unchanging):
    """An image that triangles wear: `Mesh(..., uv=uv, texture=Texture(image))`.

    image : (H, W, 3), or (H, W, 4) with alpha, not multiplied by it; sides up to 16,384. Floats:
        colour finite and not negative, alpha in [0, 1]. uint8 and uint16 are divided by 255 and
        65,535, and need color_space.
    color_space : "linear" or "srgb": how colour is encoded; None: floats are linear. Alpha is
        linear always.
    wrap : of coordinates outside [0, 1]: "repeat", "mirror" (each other copy is turned over) or
        "clamp" (the texels at the edge go on); one for both axes, or (of u, of v).
    filter : "nearest", the texel that holds the point; "bilinear", between the four next to it;
        "mipmap", where the picture's pixels are larger than texels between smaller images, each
        half the one before, by how fast coordinates change in the pixel's middle (trilinear).

    u runs along a row and v down the rows, as in glTF: (0, 0) is the upper left corner of the image
    (of the first row and column), (1, 1) the lower right. Files whose v runs up, as OBJ's, hold
    1 - v. Colour is filtered as it is, not multiplied by alpha, within an image; smaller images are
    means by area in which texels count colour by their alpha, so that what is transparent does not
    bleed.

    Arrays are held as read-only copies. Raises TypeError and ValueError that name the argument.

    >>> glass = moit.Texture([[[1.0, 1, 1, 0.5], [0, 0, 0, 1]]], filter="nearest")
    >>> glass.transparent
    True
    """

    image: Any
    _: dataclasses.KW_ONLY
    color_space: str | None = None
    wrap: str | tuple[str, str] = "repeat"
    filter: str = "mipmap"
    texels: Array = dataclasses.field(init=False, repr=False)  # (H, W, 4) linear float32

    def __post_init__(self) -> None:
        array = as_array(self.image, "image")
        if self.color_space is not None:
            one_of("color_space", self.color_space, COLOR_SPACES)
        one_of("filter", self.filter, FILTERS)
        for one in self.wraps:
            one_of("wrap", one, WRAPS)
        texels = _texels(array, self.color_space)
        texels.flags.writeable = False
        image: Array = np.array(array)
        image.flags.writeable = False
        object.__setattr__(self, "image", image)
        object.__setattr__(self, "texels", texels)

    def __repr__(self) -> str:
        height, width, _ = self.texels.shape
        wrap = self.wrap if isinstance(self.wrap, str) else " and ".join(self.wrap)
        return f"Texture({width} x {height} texels, {self.filter}, {wrap})"

    @property
    def wraps(self) -> tuple[str, str]:
        """Of u and of v."""
        if isinstance(self.wrap, str):
            return self.wrap, self.wrap
        if not isinstance(self.wrap, tuple) or len(self.wrap) != 2:
            raise ValueError(
                f"wrap: expected one name, or a tuple of two, of u and of v; got {self.wrap!r:.80}"
            )
        return self.wrap

    @functools.cached_property
    def levels(self) -> Array:
        """(N, 4): the texels, and those of smaller images where they are asked for."""
        if self.filter == "mipmap":
            return _core.texture_levels(self.texels)
        return self.texels.reshape(-1, 4)

    @functools.cached_property
    def transparent(self) -> bool:
        """Whether it lets light through somewhere."""
        return bool((self.texels[..., 3] < 1).any())


def _texels(image: Array, color_space: str | None) -> Array:
    if image.ndim != 3 or image.shape[2] not in (3, 4) or not 0 < min(image.shape[:2]):
        raise ValueError(f"image: expected shape (H, W, 3) or (H, W, 4), got {image.shape}")
    if max(image.shape[:2]) > MOST_SIDE:
        raise ValueError(f"image: expected sides of at most {MOST_SIDE} texels, got {image.shape}")
    greatest = GREATEST.get(image.dtype)
    if greatest is None and image.dtype.kind != "f":
        raise TypeError(f"image: expected floats, uint8 or uint16, got {image.dtype}")
    if greatest is not None and color_space is None:
        raise ValueError(
            f"image: {image.dtype} does not say what its numbers mean; needed color_space='srgb' "
            "for a picture, 'linear' for numbers"
        )
    texels = np.ones((*image.shape[:2], 4), np.float32)
    alpha = texels[..., 3 : image.shape[2]]  # nothing where there is none
    if greatest is not None:
        share = np.arange(greatest + 1) / greatest
        color = from_srgb(share) if color_space == "srgb" else share
        texels[..., :3] = np.take(color.astype(np.float32), image[..., :3])
        alpha[:] = np.take(share.astype(np.float32), image[..., 3:])
        return texels
    values = finite(image, "image", np.float32)
    wrong = values < 0
    wrong[..., 3:] |= values[..., 3:] > 1
    if wrong.any():
        at = np.unravel_index(int(wrong.argmax()), wrong.shape)
        needed = "alpha in [0, 1]" if at[2] == 3 else "a number that is not negative"
        place = ", ".join(str(int(i)) for i in at)
        raise ValueError(f"image[{place}]: found {image[at]}; needed {needed}")
    texels[..., :3] = from_srgb(values[..., :3]) if color_space == "srgb" else values[..., :3]
    alpha[:] = values[..., 3:]
    return texels


WHITE = Texture(np.ones((1, 1, 4), np.float32), filter="nearest")  # of a mesh that has none
