"""Meshes drawn small by a technique's own passes, and read between their pixels."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from moit.geometry.squares import Squares
from moit.gpu.bindings import (
    BLOCK_OCCLUDERS,
    DRAW_SHADES,
    FARTHEST_OCCLUDER,
    OCCLUDERS,
    SMALL_OCCLUDERS,
    SMALL_SECOND,
    SMALL_SHADE,
)
from moit.gpu.meshes import Drawing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from moit.geometry.camera import Camera
    from moit.geometry.squares import Parts
    from moit.gpu.rendering import Picture


@dataclasses.dataclass
class SmallPicture:
    """Triangles that are drawn in squares of `side` pixels of a whole picture.

    before : pixels that the first squares have beyond the picture.
    """

    drawing: Drawing
    side: int
    before: tuple[int, int]

    @property
    def uniforms(self) -> dict[str, Any]:
        size = (self.drawing.width, self.drawing.height)
        return {"block_side": self.side, "blocks_there": size, "before": self.before}

    def add_to(self, picture: Picture, shaded: list[Any], buffers: dict[int, Any]) -> None:
        """Draws, and adds what targets then hold to the picture's.

        buffers : that passes name; these write none."""
        self._hide(picture)
        drawn = picture.drawn
        assert drawn is not None
        assert drawn.second is not None
        size = (self.drawing.width, self.drawing.height)
        targets = picture.targets("small colour", [picture.target], (0.0,) * 4, size)
        clear = (drawn.second.clear,) * 4
        targets += picture.targets("small colour", [drawn.second.format], clear, size)
        blend = [drawn.blend, drawn.second.blend]
        with picture.timed("shade small"):
            self.drawing.draw(
                self.drawing.transparent,
                f"techniques/{picture.passes.shader}",
                picture.defines(DRAW_SHADES),
                buffers=buffers,
                textures={OCCLUDERS: self.drawing.occluders},
                uniforms={**picture.uniforms, **self.drawing.uniforms, "image_width": size[0]},
                targets=targets,
                blend=blend,
            )
        whole = picture.drawing
        program = picture.device.drawing(
            "meshes/whole.vert.glsl",
            "meshes/upsampled.frag.glsl",
            DOUBLE=0,
            DEPTH_AWARE=int(picture.depth_aware),
            MULTIPLIES=int(drawn.second.blend == "multiply-complement"),
        )
        with picture.timed("upsample"):
            picture.device.draw(
                program,
                3,
                textures={
                    OCCLUDERS: whole.occluders,
                    SMALL_OCCLUDERS: self.drawing.occluders,
                    SMALL_SHADE: targets[0],
                    SMALL_SECOND: targets[1],
                },
                uniforms={**whole.uniforms, **self.uniforms},
                targets=shaded,
                blend=blend,
            )

    def _hide(self, picture: Picture) -> None:
        """Its opaque surfaces are some of the picture's (`Squares.occluders`)."""
        drawing = self.drawing
        occluders = picture.device.texture("r32f", drawing.width, drawing.height)
        with picture.timed("downsample"):
            picture.drawing.run(
                FARTHEST_OCCLUDER,
                drawing.width * drawing.height,
                {},
                uniforms={**self.uniforms, "alternates": int(picture.depth_aware)},
                images={BLOCK_OCCLUDERS: occluders},
            )
        drawing.occluders = occluders


def small_pictures(
    picture: Picture, parts: Parts, camera: Camera, lights: NDArray[Any], threads: int
) -> list[SmallPicture]:
    """Of what a picture draws small."""
    whole = picture.drawing
    found = []
    for side, meshes in parts.small.items():
        squares = Squares((whole.width, whole.height), side)
        drawing = Drawing(
            picture.device,
            meshes,
            squares.camera(camera),
            *squares.size,
            lights=lights,
            threads=threads,
        )
        found.append(SmallPicture(drawing, side, squares.before))
    return found
