"""Textures of others in one context: opaque surfaces that they drew, room for the picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from moit.checks.exceptions import GpuError
from moit.gpu.bindings import ANSWERS, THEIR_COLOR, THEIR_DEPTH

if TYPE_CHECKING:
    from moit.gpu.device import Device
    from moit.gpu.meshes import Drawing

DEPTHS = ("depth16", "depth24", "depth32", "depth32f", "depth24_stencil8", "depth32f_stencil8")


class ForeignTextures:
    """What is taken from others' textures, and given to one; while the device is current.

    opaque : (color, depth) or None; into : one texture or None. Each is a GL name, or has it as
        `glo`. Raises TypeError, and GpuError where one is not what the picture needs.
    """

    def __init__(self, device: Device, size: tuple[int, int], opaque: Any, into: Any) -> None:
        self.device, self.size = device, size
        self.opaque = None
        if opaque is not None:
            color, depth = _pair(opaque)
            self.opaque = (self._texture("opaque[0]", color), self._texture("opaque[1]", depth))
            if self.opaque[1].format not in DEPTHS:
                raise GpuError(
                    f"opaque[1]: expected a depth texture, got {self.opaque[1].format}; moderngl "
                    "makes one by ctx.depth_texture(size)"
                )
            if self.opaque[0].format in DEPTHS:
                raise GpuError(f"opaque[0]: expected a colour, got {self.opaque[0].format}")
        self.into = None if into is None else self._texture("into", into)
        if self.into is not None and self.into.format in DEPTHS:
            raise GpuError(f"into: expected a colour texture, got {self.into.format}")

    def _texture(self, name: str, given: Any) -> Any:
        glo = getattr(given, "glo", given)
        if isinstance(glo, bool) or not isinstance(glo, int):
            raise TypeError(
                f"{name}: expected a texture's GL name, or what has one as glo, got "
                f"{type(given).__name__}"
            )
        texture = self.device.wrap_texture(glo)
        if (texture.width, texture.height) != self.size:
            raise GpuError(
                f"{name}: expected a texture of {self.size[0]} x {self.size[1]}, as the picture "
                f"is, got {texture.width} x {texture.height}"
            )
        return texture

    def draw_occluders(self, drawing: Drawing, near: float, far: float) -> None:
        """Their surfaces into the drawing's, which are empty."""
        if self.opaque is None:
            return
        self.device.draw(
            self._program(takes=1),
            3,
            textures=dict(zip((THEIR_COLOR, THEIR_DEPTH), self.opaque, strict=True)),
            targets=[drawing.occluder_colors],
            depth=drawing.occluders,
            depth_test="lequal",
            depth_write=True,
            uniforms={
                "height": self.size[1],
                "near": near,
                "far": far,
                "occluder_scale": drawing.occluder_scale,
            },
        )

    def give(self, answers: Any) -> None:
        """The picture, from a buffer, into their texture."""
        assert self.into is not None
        self.device.draw(
            self._program(takes=0),
            3,
            buffers={ANSWERS: answers},
            targets=[self.into],
            uniforms={"width": self.size[0], "height": self.size[1]},
        )

    def _program(self, takes: int) -> Any:
        return self.device.drawing(
            "meshes/whole.vert.glsl", "meshes/foreign.frag.glsl", TAKES=takes
        )


def _pair(opaque: Any) -> tuple[Any, Any]:
    try:
        color, depth = opaque
    except (TypeError, ValueError):
        raise TypeError(
            f"opaque: expected two textures, of colour and of depth, got {type(opaque).__name__}"
        ) from None
    return color, depth
