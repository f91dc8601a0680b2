"""A device for tests: llvmpipe, wherever it is."""

from functools import cache

import pytest

import moit


@cache
def device() -> moit.gpu.Device:
    """One for all tests; skips, with the reason, where there is none."""
    try:
        return moit.gpu.Device()
    except moit.GpuError as error:
        pytest.skip(str(error))
