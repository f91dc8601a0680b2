"""Devices for tests."""

from functools import cache

import numpy as np
import pytest

import moit


def needs_passes(technique) -> None:
    """Skips where the technique has no passes yet."""
    from moit.gpu import passes

    if technique.engine == "core" and not passes.has_passes(technique):
        pytest.skip(f"{technique} has no passes")


@cache
def device() -> moit.gpu.Device:
    """One for all tests, a GPU where there is one; skips, with the reason, where there is none."""
    try:
        return moit.gpu.Device()
    except moit.GpuError as error:
        pytest.skip(str(error))


@cache
def software_device() -> moit.gpu.Device:
    """llvmpipe, which divides and takes roots exactly, so that its bits can be C's. GPUs do not."""
    found = device()
    for index in range(16):
        if found.software:
            return found
        try:
            found = moit.gpu.Device(index)
        except moit.GpuError:
            break
    pytest.skip(f"no software renderer beside {device().renderer}")


def expect_bits_of_the_core(f: moit.Fragments, technique) -> None:
    """Passes over arrays give every question's answer to the bit."""
    for ask in (
        lambda where: moit.transmittance(f, technique, device=where),
        lambda where: moit.composite(f, technique, background=(1, 0, 0), device=where),
        lambda where: moit.total_transmittance(f, technique, device=where),
        lambda where: moit.transmittance(f, technique, depth=[1.2, 2.0], device=where),
    ):
        np.testing.assert_array_equal(ask(software_device()), ask("cpu"))
