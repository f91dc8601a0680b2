"""Small pictures for pages: shrunk, encoded as sRGB, coloured maps, as PNG in memory.

Files that programs read go through `moit.images`; here a page needs bytes, and few of them.
"""

from __future__ import annotations

import base64
import functools
import os
import struct
import zlib
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.system.image_library import complaint, image_library

Array = NDArray[Any]
Bytes = NDArray[np.uint8]

# Dark to light in Oklab (L, a, b): lightness rises evenly, so that equal steps of error look
# equal, also without colour and to colour-blind eyes. Oklab: Bjoern Ottosson, 2020.
ERROR_COLOURS = (
    (0.08, 0.00, -0.02),
    (0.25, 0.05, -0.13),
    (0.42, 0.15, -0.10),
    (0.58, 0.19, 0.02),
    (0.72, 0.12, 0.12),
    (0.86, 0.01, 0.15),
    (0.98, -0.03, 0.08),
)


def srgb(linear: Array) -> Array:
    """sRGB-encoded values of linear ones, clipped to [0, 1] (IEC 61966-2-1)."""
    clipped = np.clip(linear, 0.0, 1.0)
    return np.where(
        clipped <= 0.0031308, 12.92 * clipped, 1.055 * np.power(clipped, 1 / 2.4) - 0.055
    )


def from_srgb(encoded: Array) -> Array:
    """Linear values of sRGB-encoded ones, those above 1 by the same curve (IEC 61966-2-1)."""
    exact = encoded.astype(np.float64)
    return np.where(exact <= 0.04045, exact / 12.92, ((exact + 0.055) / 1.055) ** 2.4)


def srgb8(linear: Array) -> Bytes:
    """(H, W, 3) bytes of a linear (H, W, 3|4) image."""
    return np.rint(255.0 * srgb(np.asarray(linear[..., :3], np.float64))).astype(np.uint8)


def shrunk(values: Array, height: int, width: int) -> Array:
    """(height, width, ...) means over blocks of an array at least that large."""
    blocks = values
    for axis, size in enumerate((height, width)):
        edges = np.linspace(0, values.shape[axis], size + 1).round().astype(np.intp)
        sums = np.add.reduceat(blocks, edges[:-1], axis=axis, dtype=np.float64)
        counts = np.diff(edges).reshape([-1 if k == axis else 1 for k in range(sums.ndim)])
        blocks = sums / counts
    return blocks


def size_within(shape: tuple[int, int], width: int) -> tuple[int, int]:
    """Height and width of an image of that shape, made no wider than `width`."""
    if shape[1] <= width:
        return shape
    return max(1, round(shape[0] * width / shape[1])), width


@functools.cache
def error_palette() -> Bytes:
    """(256, 3) sRGB bytes, from no error to the greatest."""
    anchors = np.array(ERROR_COLOURS)
    at = np.linspace(0, len(anchors) - 1, 256)
    lab = np.stack([np.interp(at, range(len(anchors)), anchors[:, k]) for k in range(3)], axis=1)
    return srgb8(oklab_to_linear(lab))


def oklab_to_linear(lab: Array) -> Array:
    """(..., 3) linear sRGB of Oklab colours; may lie outside [0, 1]."""
    roots = lab @ np.array(
        [[1, 1, 1], [0.3963377774, -0.1055613458, -0.0894841775],
         [0.2158037573, -0.0638541728, -1.2914855480]]
    )  # fmt: skip
    return np.asarray(
        roots**3
        @ np.array(
            [[4.0767416621, -1.2684380046, -0.0041960863],
             [-3.3077115913, 2.6097574011, -0.7034186147],
             [0.2309699292, -0.3413193965, 1.7076147010]]
        )
    )  # fmt: skip


def png(pixels: Bytes, palette: Bytes | None = None) -> bytes:
    """A PNG file of (H, W, 3) sRGB bytes, or of (H, W) indices into a (256, 3) palette.

    W3C, Portable Network Graphics (Third Edition). Rows are stored as differences from the row
    above: pictures compress better so, and NumPy takes them at once.
    """
    height, width = pixels.shape[:2]
    rows = pixels.reshape(height, -1)
    filtered = np.empty((height, rows.shape[1] + 1), np.uint8)
    filtered[:, 0] = 2 if palette is None else 0  # "up"; indices are best left as they are
    filtered[:, 1:] = rows
    if palette is None:
        filtered[1:, 1:] -= rows[:-1]
    kind = 2 if palette is None else 3
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0))]
    if palette is not None:
        chunks.append((b"PLTE", palette.tobytes()))
    chunks += [(b"IDAT", zlib.compress(filtered.tobytes(), 6)), (b"IEND", b"")]
    file = b"\x89PNG\r\n\x1a\n"
    for name, content in chunks:
        file += struct.pack(">I", len(content)) + name + content
        file += struct.pack(">I", zlib.crc32(name + content))
    return file


def data_uri(file: bytes) -> str:
    """A PNG or JPEG file as an address that holds it."""
    kind = "jpeg" if file.startswith(b"\xff\xd8") else "png"
    return f"data:image/{kind};base64,{base64.b64encode(file).decode()}"


def image_png(linear: Array, width: int) -> bytes:
    """A linear (H, W, 3|4) image, shrunk to at most that width, as sRGB."""
    values = linear[..., :3]
    size = size_within((values.shape[0], values.shape[1]), width)
    return png(srgb8(shrunk(np.clip(values, 0, None), *size)))


def image_jpeg(linear: Array, width: int, quality: int = 82) -> bytes:
    """The same with loss, in a fifth of the bytes."""
    values = linear[..., :3]
    size = size_within((values.shape[0], values.shape[1]), width)
    pixels = srgb8(shrunk(np.clip(values, 0, None), *size))
    oiio = image_library()
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    spec.attribute("Compression", f"jpeg:{quality}")
    # Through a pipe, not a file: libjpeg ends the process where a disk is full.
    source, target = os.pipe()
    with ThreadPoolExecutor(1) as readers, open(source, "rb") as file:
        content = readers.submit(file.read)
        out = oiio.ImageOutput.create("jpeg")
        try:
            written = out.open(f"/dev/fd/{target}", spec)
        finally:
            os.close(target)  # the library has opened it for itself
        try:
            written = written and out.write_image(pixels)
        finally:
            written = out.close() and written  # which ends what is read
        if not written:
            raise OSError(f"cannot make a JPEG: {complaint(out)}")
        return content.result()


def map_png(errors: Array, width: int) -> bytes:
    """An (H, W) map of errors in [0, 1], shrunk, in the colours of `error_palette`."""
    size = size_within((errors.shape[0], errors.shape[1]), width)
    indices = np.rint(255 * np.clip(shrunk(errors, *size), 0, 1)).astype(np.uint8)
    return png(indices, error_palette())
