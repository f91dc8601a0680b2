"""How far an image is from its reference: errors as one number, and as a map.

Images are arrays (height, width, 3 or 4) of linear RGB, float32 or float64 (float16 becomes
float32), at least 11 pixels a side; a fourth channel, alpha, is ignored. Both must have the same
height and width. Every function raises

- TypeError where an argument is not an array of floats. Integers are refused because they are
  nearly always sRGB-encoded and of a range of 0 to 255, not linear and of a range of 1;
- ValueError where a shape does not fit, or a value is NaN or infinite (with its index).

`threads` is how many threads work, by default MOIT_THREADS or all processors; results are the
same bits for any number. Maps have the images' dtype: float64 where either image is.

`mse`, `rmse`, `mae` and `psnr` are of linear values with a range of 1, over R, G and B alike.
`ssim` and `flip` are of what a display shows: values clipped to [0, 1] and encoded as sRGB.
`hdr_flip` is of linear values of any range.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.checks.arrays import as_array
from moit.checks.exceptions import FragmentsTypeError
from moit.system.environment import thread_count

#: The metrics' names, in the order of `errors`.
NAMES = ("mse", "rmse", "mae", "psnr", "ssim", "flip", "hdr_flip")

#: What a `Reference` keeps at most, so that with what threads need it stays below 64 MiB.
KEPT_BYTES = 48 << 20

#: Fewer pixels a side do not hold the window of `ssim`.
LEAST_SIDE = 11


def errors(
    image: ArrayLike, reference: ArrayLike, *, threads: int | None = None
) -> dict[str, float]:
    """Every error of an image: mse, rmse, mae, psnr, ssim, flip and hdr_flip.

    image, reference : (H, W, 3 or 4), linear RGB; see `moit.metrics` for what is raised.

    >>> found = moit.errors(np.zeros((16, 16, 3)), np.full((16, 16, 3), 0.5))
    >>> found["mse"], found["mae"]
    (0.25, 0.5)
    """
    pair, count = _images(image, reference), thread_count(threads)
    found = _core.image_errors(NAMES, pair[0], _core.reference_of(pair[1], 0), count)
    return dict(zip(NAMES, found, strict=True))


class Reference:
    """What many images are held against: `errors` of each, with the reference's part found once.

    image : (H, W, 3 or 4), linear RGB; see `moit.metrics` for what is raised. It is copied unless
        it is an array in C order already, which must not change then.

    What is found out of the reference is kept with it, up to 48 MiB; answers are the same bits
    without. Calls from several threads wait for one another.

    >>> black, gray = np.zeros((16, 16, 3)), np.full((16, 16, 3), 0.5)
    >>> reference = moit.metrics.Reference(gray)
    >>> reference.errors(black, ["mse", "mae"]), reference.errors(gray, ["mse", "mae"])
    ({'mse': 0.25, 'mae': 0.5}, {'mse': 0.0, 'mae': 0.0})
    """

    def __init__(self, image: ArrayLike) -> None:
        self._image = _contiguous(_floats(image, "image"), "image")
        self._kept = _core.reference_of(self._image, KEPT_BYTES)

    @property
    def shape(self) -> tuple[int, int]:
        """Its height and width."""
        height, width = self._image.shape[:2]
        return height, width

    def __reduce__(self) -> tuple[type[Reference], tuple[NDArray[Any]]]:
        return Reference, (self._image,)  # what is kept is found again

    def __repr__(self) -> str:
        height, width = self.shape
        return f"Reference({height}x{width})"

    def errors(
        self, image: ArrayLike, names: Iterable[str] = NAMES, *, threads: int | None = None
    ) -> dict[str, float]:
        """Errors of an image by their names, in this order: the same bits as `moit.errors`.

        image : (H, W, 3 or 4) of the reference's height and width. names : or one.

        Raises ValueError where a name is not in `NAMES`, and what `moit.metrics` says of images.
        """
        wanted = (names,) if isinstance(names, str) else tuple(names)
        for name in wanted:
            if name not in NAMES:
                raise ValueError(f"names: expected some of {', '.join(NAMES)}, got {name!r:.80}")
        array = _floats(image, "image")
        _check_same_size(array, self._image)
        array = _contiguous(array, "image")
        found = _core.image_errors(wanted, array, self._kept, thread_count(threads))
        return dict(zip(wanted, found, strict=True))


def mse(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> float:
    """Mean squared error of linear values; 0 for equal images.

    >>> black, gray = np.zeros((16, 16, 3)), np.full((16, 16, 3), 0.5)
    >>> moit.metrics.mse(black, gray)
    0.25
    """
    return _error("mse", image, reference, threads)


def mse_map(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> NDArray[Any]:
    """(H, W): the mean of a pixel's three squared errors. Its mean is `mse`.

    >>> black, gray = np.zeros((16, 16, 3)), np.full((16, 16, 3), 0.5)
    >>> round(float(moit.metrics.mse_map(black, gray)[0, 0]), 2)
    0.25
    """
    return _map("mse", image, reference, threads)


def rmse(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> float:
    """Root of the mean squared error of linear values; 0 for equal images.

    >>> black, gray = np.zeros((16, 16, 3)), np.full((16, 16, 3), 0.5)
    >>> moit.metrics.rmse(black, gray)
    0.5
    """
    return _error("rmse", image, reference, threads)


def rmse_map(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> NDArray[Any]:
    """(H, W): the root of `mse_map`, pixel by pixel. `rmse` is the root of its mean square.

    >>> black, gray = np.zeros((16, 16, 3)), np.full((16, 16, 3), 0.5)
    >>> round(float(moit.metrics.rmse_map(black, gray)[0, 0]), 2)
    0.5
    """
    return _map("rmse", image, reference, threads)


def mae(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> float:
    """Mean absolute error of linear values; 0 for equal images.

    >>> black, gray = np.zeros((16, 16, 3)), np.full((16, 16, 3), 0.5)
    >>> moit.metrics.mae(black, gray)
    0.5
    """
    return _error("mae", image, reference, threads)


def mae_map(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> NDArray[Any]:
    """(H, W): the mean of a pixel's three absolute errors. Its mean is `mae`.

    >>> black, gray = np.zeros((16, 16, 3)), np.full((16, 16, 3), 0.5)
    >>> round(float(moit.metrics.mae_map(black, gray)[0, 0]), 2)
    0.5
    """
    return _map("mae", image, reference, threads)


def psnr(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> float:
    """Peak signal to noise ratio in decibels, -10 log10 of `mse`: linear values, a peak of 1.

    Infinite for equal images; negative where the mean squared error exceeds 1.

    >>> black, gray = np.zeros((16, 16, 3)), np.full((16, 16, 3), 0.5)
    >>> round(moit.metrics.psnr(black, gray), 2)
    6.02
    """
    return _error("psnr", image, reference, threads)


def psnr_map(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> NDArray[Any]:
    """(H, W): -10 log10 of `mse_map`, pixel by pixel; infinite where pixels are equal.

    >>> black, gray = np.zeros((16, 16, 3)), np.full((16, 16, 3), 0.5)
    >>> round(float(moit.metrics.psnr_map(black, gray)[0, 0]), 2)
    6.02
    """
    return _map("psnr", image, reference, threads)


def ssim(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> float:
    """Mean structural similarity; 1 for equal images, less for others, at least -1.

    Of R, G and B apart, clipped to [0, 1] and encoded as sRGB, then averaged. Gaussian window of
    sigma 1.5 cut at 11 taps, K1 = 0.01, K2 = 0.03, covariances divided by the sum of weights; the
    mean leaves out a border of 5 pixels. What scikit-image gives for gaussian_weights=True,
    sigma=1.5, use_sample_covariance=False, data_range=1. Wang, Bovik, Sheikh, Simoncelli, "Image
    quality assessment: from error visibility to structural similarity", 2004.

    >>> gray = np.full((16, 16, 3), 0.5)
    >>> round(moit.metrics.ssim(gray, gray), 3)
    1.0
    """
    return _error("ssim", image, reference, threads)


def ssim_map(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> NDArray[Any]:
    """(H, W): structural similarity round each pixel; see `ssim`.

    The image is mirrored at its border. The mean of [5:-5, 5:-5] is `ssim`.

    >>> gray = np.full((16, 16, 3), 0.5)
    >>> moit.metrics.ssim_map(gray, gray).shape
    (16, 16)
    """
    return _map("ssim", image, reference, threads)


def flip(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> float:
    """Mean FLIP error, what an eye sees when the images alternate; 0 for equal images, at most 1.

    Of values clipped to [0, 1] and encoded as sRGB, seen at 67.02 pixels per degree (0.7 m from a
    display 0.7 m and 3840 pixels wide). Computed in float32. Andersson, Nilsson, Akenine-Moeller,
    Oskarsson, Astroem, Fairchild, "FLIP: A Difference Evaluator for Alternating Images", 2020.

    >>> gray = np.full((16, 16, 3), 0.5)
    >>> round(moit.metrics.flip(gray, gray), 3)
    0.0
    """
    return _error("flip", image, reference, threads)


def flip_map(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> NDArray[Any]:
    """(H, W): the FLIP error of each pixel, in [0, 1]. Its mean is `flip`.

    >>> gray = np.full((16, 16, 3), 0.5)
    >>> moit.metrics.flip_map(gray, gray).shape
    (16, 16)
    """
    return _map("flip", image, reference, threads)


def hdr_flip(image: ArrayLike, reference: ArrayLike, *, threads: int | None = None) -> float:
    """Mean HDR-FLIP error; 0 for equal images, at most 1.

    The greatest FLIP error of each pixel over exposures. The first exposure brings the reference's
    greatest luminance to 0.85 on the ACES curve, the last its median; between them one a stop, two
    at least. So time grows with the reference's range: a reference that is half black takes some
    25 times as long as `flip`. Luminances are taken to be at least 2^-23, the epsilon of float32:
    a black reference compares like one that has this luminance somewhere, and two black images
    have no error. Negative radiance counts as 0. Not symmetric.

    Andersson, Nilsson, Shirley, Akenine-Moeller, "Visualizing Errors in Rendered High Dynamic
    Range Images", 2021, with the defaults of flip-evaluator.

    >>> gray = np.full((16, 16, 3), 0.5)
    >>> round(moit.metrics.hdr_flip(gray, gray), 3)
    0.0
    """
    return _error("hdr_flip", image, reference, threads)


def hdr_flip_map(
    image: ArrayLike, reference: ArrayLike, *, threads: int | None = None
) -> NDArray[Any]:
    """(H, W): the HDR-FLIP error of each pixel, in [0, 1]. Its mean is `hdr_flip`.

    >>> gray = np.full((16, 16, 3), 0.5)
    >>> moit.metrics.hdr_flip_map(gray, gray).shape
    (16, 16)
    """
    return _map("hdr_flip", image, reference, threads)


def _error(name: str, image: ArrayLike, reference: ArrayLike, threads: int | None) -> float:
    return _core.image_error(name, *_images(image, reference), False, thread_count(threads))


def _map(name: str, image: ArrayLike, reference: ArrayLike, threads: int | None) -> NDArray[Any]:
    return _core.image_error(name, *_images(image, reference), True, thread_count(threads))


def _images(image: ArrayLike, reference: ArrayLike) -> tuple[NDArray[Any], NDArray[Any]]:
    """Both as C-contiguous arrays of one dtype, checked."""
    a, b = _floats(image, "image"), _floats(reference, "reference")
    _check_same_size(a, b)
    double = a.dtype.itemsize > 4 or b.dtype.itemsize > 4
    return _contiguous(a, "image", double), _contiguous(b, "reference", double)


def _check_same_size(image: NDArray[Any], reference: NDArray[Any]) -> None:
    a, b = image.shape, reference.shape
    if a[:2] != b[:2]:
        raise ValueError(
            f"image is {a[0]} x {a[1]} (height x width) and reference {b[0]} x {b[1]}; "
            "expected the same size"
        )


def _contiguous(array: NDArray[Any], name: str, double: bool = False) -> NDArray[Any]:
    """As the core reads it, float64 where it has more digits than float32; finite."""
    dtype = np.dtype(np.float64 if double or array.dtype.itemsize > 4 else np.float32)
    with np.errstate(over="ignore"):  # a long double that becomes infinite is reported as such
        array = np.require(array, dtype, ["C", "A"])
    _check_finite(array, name)
    return array


def _floats(value: ArrayLike, name: str) -> NDArray[Any]:
    if isinstance(value, Reference):
        raise TypeError(f"{name}: expected an array; a Reference has `errors` of its own")
    try:
        array = as_array(value, name)
    except FragmentsTypeError as error:
        raise TypeError(*error.args) from error
    if array.dtype.kind in "iub":
        raise TypeError(
            f"{name}: expected linear floats, got {array.dtype}; "
            "divide integers by their greatest value and decode sRGB first"
        )
    if array.dtype.kind != "f":
        raise TypeError(f"{name}: expected an array of floats, got {array.dtype}")
    if array.ndim != 3 or array.shape[2] not in (3, 4):
        raise ValueError(f"{name}: expected (height, width, 3 or 4), got {array.shape}")
    if min(array.shape[:2]) < LEAST_SIDE:
        raise ValueError(
            f"{name}: expected at least {LEAST_SIDE} pixels a side, got {array.shape[0]} x "
            f"{array.shape[1]} (height x width)"
        )
    return array


def _check_finite(array: NDArray[Any], name: str) -> None:
    if np.isfinite(array).all():  # of an alpha, too, which may be anything
        return
    finite = np.isfinite(array[..., :3])
    if not finite.all():
        y, x, channel = (int(i) for i in np.unravel_index(finite.argmin(), finite.shape))
        raise ValueError(
            f"{name}[{y}, {x}, {channel}]: expected a finite number, got {array[y, x, channel]}"
        )
