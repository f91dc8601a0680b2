"""The numbers of passes, buffers and textures, which shaders and what runs them share.

They are written in shaders/arrays/bindings.glsl and csrc/kernels/options.h, once for all; each is a
name here: `from moit.gpu.bindings import CAPTURE, OFFSETS`.
"""

from __future__ import annotations

from moit import _core

SOFTWARE_ITERATIONS = 65_000  # of 65,535 that llvmpipe has (gallivm's LP_MAX_TGSI_LOOP_ITERATIONS)

_NUMBERS = _core.numbers()


def __getattr__(name: str) -> int:
    try:
        return _NUMBERS[name]
    except KeyError:
        raise AttributeError(f"the shaders have no number {name}") from None


def group_counts(threads: int) -> tuple[int, int, int]:
    """Work groups for so many threads, in rows that every device can have."""
    groups = -(-threads // _NUMBERS["GROUP"])
    rows = -(-groups // 65535)
    return -(-groups // rows), rows, 1
