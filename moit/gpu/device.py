"""Devices: contexts of OpenGL 4.5, made by EGL or found in this thread, and their programs."""

from __future__ import annotations

import functools
import os
import threading
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from moit import _gl
from moit.checks.exceptions import GpuError
from moit.gpu import texts as shaders
from moit.gpu.bindings import ANSWERS, ASKED

__all__ = ["Device", "default_device"]


class Device:
    """An OpenGL 4.5 context on a GPU, or on a processor by Mesa's llvmpipe.

    index : the device in EGL's order; None: a GPU before a processor.

    `with device:` makes its context current in this thread; the end of the block puts back what
    was current before. Blocks nest. `moderngl.create_context(context=device)` within such a block
    draws in the same context; its state of GL is put back at the end of each `with device:`.

    Threads: a device belongs to one thread at a time, from the outermost `with` to its end. Another
    that enters meanwhile gets a GpuError; threads that work at once need a device each. Only
    `default_device()` lets them wait for one another. Objects may be dropped in any thread; a
    process that was forked needs a new device.

    Raises GpuError where libEGL, a driver or OpenGL 4.5 is missing, and says what to install.

    >>> device = moit.gpu.Device()
    >>> moit.composite(moit.scenes.load("panes", (8, 6)), "power4", device=device).shape
    (6, 8, 4)
    >>> device.close()
    """

    def __init__(self, index: int | None = None) -> None:
        self._start(_gl.Context(index=index))

    def _start(self, context: _gl.Context) -> None:
        self.context = context
        self._programs: dict[tuple[Any, ...], _gl.Program] = {}
        self._queue: threading.RLock | None = None
        self.begin_time = context.begin_time
        self.buffer = context.buffer
        self.clear = context.clear
        self.dispatch = context.dispatch
        self.draw = context.draw
        self.end_time = context.end_time
        self.fill = context.fill
        self.finish = context.finish
        self.seconds = context.seconds
        self.texture = context.texture
        self.wrap_texture = context.wrap_texture

    @classmethod
    def current(cls) -> Device:
        """The context that is current in this thread, such as moderngl's.

        It stays its owner's: what passes change of GL's state is put back at the end of
        `with device:`. EGL must have made it. Close this before the context.
        """
        device = cls.__new__(cls)
        device._start(_gl.Context(adopt=True))
        return device

    @property
    def info(self) -> dict[str, Any]:
        """renderer, vendor, version, platform, software, extensions, and limits."""
        return self.context.info

    @property
    def renderer(self) -> str:
        """What draws, in the driver's words."""
        return str(self.context.info["renderer"])

    @property
    def software(self) -> bool:
        """Whether a processor draws."""
        return bool(self.context.info["software"])

    @property
    def storage_bytes(self) -> int:
        """How many bytes of a buffer a pass can see."""
        return int(self.context.info["storage_bytes"])

    @functools.cached_property
    def fuses(self) -> bool:
        """Whether a shader's fma rounds once, as those of GPUs do; GLSL does not promise it."""
        answer = np.zeros(1, np.float32)
        with self:
            asked = self.buffer(4, np.full(1, 1 + 2.0**-12, np.float32))
            answers = self.buffer(4)
            self.dispatch(
                self.program("arrays/fused.glsl"),
                (1, 1, 1),
                buffers={ASKED: asked, ANSWERS: answers},
            )
            answers.read(answer)
        return bool(answer[0] != 0)

    def __repr__(self) -> str:
        return f"<moit.gpu.Device {self.renderer}, {self.info['platform']}>"

    def __enter__(self) -> Device:
        if self._queue:
            self._queue.acquire()
        try:
            self.context.enter()
        except BaseException:
            if self._queue:
                self._queue.release()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None = None,
        error: BaseException | None = None,
        trace: TracebackType | None = None,
    ) -> None:
        try:
            self.context.exit()
        finally:
            if self._queue:
                self._queue.release()

    def close(self) -> None:
        """Free all that was made here. What is used later raises GpuError."""
        self._programs.clear()
        self.context.close()

    # As moderngl.create_context(context=device) asks for it.

    def load_opengl_function(self, name: str) -> int:
        """The address of a function of GL, for others who draw in this context."""
        return self.context.function(name)

    def release(self) -> None:
        """Nothing: the device outlives what moderngl makes of it. `close` frees it."""

    def program(self, name: str | Path, **defines: str | float) -> _gl.Program:
        """A compute pass, compiled once for each set of defines; name as `texts.source` takes it.

        Raises GpuError with the compiler's words about our files and lines.
        """
        key: tuple[Any, ...] = (name, *sorted(defines.items()))
        text = None
        # somebody works on them
        if isinstance(name, Path) or os.environ.get("MOIT_SHADER_DIR"):
            text = shaders.source(name, **dict(sorted(defines.items())))
            key = (text,)
        if key not in self._programs:
            self._programs[key] = self.compile(compute=text or shaders.source(name, **defines))
        return self._programs[key]

    def drawing(self, vertex: str, fragment: str, **defines: str | float) -> _gl.Program:
        """A pass that draws: a vertex shader, and a fragment shader that has the defines."""
        key = (vertex, fragment, *sorted(defines.items()))
        if key not in self._programs:
            self._programs[key] = self.compile(
                vertex=shaders.source(vertex), fragment=shaders.source(fragment, **defines)
            )
        return self._programs[key]

    def compile(self, **texts: str) -> _gl.Program:
        """A program of the texts of its stages: compute, or vertex and fragment."""
        with self:
            try:
                return self.context.program(texts)
            except _gl.ShaderError as error:
                stage = error.stage
                log = shaders.explain(str(error), texts.get(stage, "")).strip()
                at = "its stages do not fit" if stage == "link" else f"the {stage} shader fails"
                raise GpuError(f"{at} on {self.renderer}:\n{log}") from None


_default: tuple[int, Device] | None = None
_default_lock = threading.Lock()


def default_device() -> Device:
    """The device of `device="gpu"`, made when first asked for, one a process.

    Any thread may ask for it and enter it: they take turns. A process that was forked makes its
    own. Raises GpuError where there is none.

    >>> moit.gpu.default_device() is moit.gpu.default_device()
    True
    """
    global _default
    with _default_lock:
        if _default is None or _default[0] != os.getpid():
            device = Device()
            device._queue = threading.RLock()
            _default = (os.getpid(), device)
        return _default[1]


def _after_fork() -> None:
    global _default_lock
    _default_lock = threading.Lock()


os.register_at_fork(after_in_child=_after_fork)
