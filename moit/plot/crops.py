"""Parts of pictures that are shown larger."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from moit.comparing.rows import Scene

Crop = tuple[int, int, int, int]  # y, x, height, width in the array
Crops = Sequence[int] | Iterable[Sequence[int]]

# Frames that are seen on light and dark pictures and told apart with any colour vision.
FRAMES = ("#ffb000", "#00b7ff", "#ff5fa2", "#7be04b")


def checked_crops(
    crops: Crops | Mapping[str, Crops] | None, scenes: Mapping[str, Scene]
) -> dict[str, list[Crop]]:
    """The crops of each scene; raises TypeError and ValueError for what is none.

    crops : (y, x, height, width), or several; for all scenes, or {scene: these}.
    scenes : those that are shown, by name.
    """
    if crops is None:
        return {name: [] for name in scenes}
    if not isinstance(crops, Mapping):
        return {name: _of_scene(crops, scene) for name, scene in scenes.items()}
    for name in crops:
        if name not in scenes:
            known = ", ".join(scenes)
            raise ValueError(f"crops: expected scenes that are shown, {known}; got {name!r:.80}")
    return {name: _of_scene(crops.get(name, ()), scene) for name, scene in scenes.items()}


def _of_scene(given: Any, scene: Scene) -> list[Crop]:
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise TypeError(
            f"crops: expected (y, x, height, width), or several, got {type(given).__name__}"
        )
    held = list(given)
    if held and all(hasattr(one, "__index__") for one in held):
        held = [held]
    if len(held) > len(FRAMES):
        raise ValueError(
            f"crops: expected at most {len(FRAMES)} of {scene.name!r:.80}, got {len(held)}"
        )
    return [_crop(one, scene) for one in held]


def _crop(given: Any, scene: Scene) -> Crop:
    try:
        y, x, height, width = (one.__index__() for one in given)
    except (AttributeError, TypeError, ValueError):
        raise TypeError(
            f"crops: expected four integers (y, x, height, width), got {given!r:.80}"
        ) from None
    whole_height, whole_width = scene.shape
    if min(height, width) < 1:
        raise ValueError(
            f"crops: expected a height and a width of at least 1, got (y, x, height, width) = "
            f"{(y, x, height, width)}"
        )
    if min(y, x) < 0 or y + height > whole_height or x + width > whole_width:
        raise ValueError(
            f"crops: (y, x, height, width) = {(y, x, height, width)} is not within "
            f"{scene.name!r:.80}, {whole_height} x {whole_width} (height x width)"
        )
    return y, x, height, width
