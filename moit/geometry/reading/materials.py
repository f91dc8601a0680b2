"""Material libraries of OBJ files (MTL): diffuse colour, opacity, and their textures."""

from __future__ import annotations

import dataclasses
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError
from moit.geometry.foreign import GREY
from moit.geometry.reading.pictures import decoded
from moit.geometry.textures import Texture

Array = NDArray[Any]

# Options of textures and how many values follow; -o, -s and -t may be followed by fewer.
OPTIONS = {
    "-blendu": 1,
    "-blendv": 1,
    "-boost": 1,
    "-bm": 1,
    "-cc": 1,
    "-clamp": 1,
    "-imfchan": 1,
    "-mm": 2,
    "-o": 3,
    "-s": 3,
    "-t": 3,
    "-texres": 1,
    "-type": 1,
}


@dataclasses.dataclass(frozen=True)
class Map:
    """A picture that a material names, and how it lies."""

    name: str
    scale: tuple[float, float] = (1.0, 1.0)
    move: tuple[float, float] = (0.0, 0.0)
    clamp: bool = False


@dataclasses.dataclass(frozen=True)
class Material:
    """color : (4,) linear. texture : what multiplies it; it lies at scale uv + move."""

    color: tuple[float, float, float, float]
    texture: Texture | None = None
    scale: tuple[float, float] = (1.0, 1.0)
    move: tuple[float, float] = (0.0, 0.0)


UNKNOWN = Material((GREY, GREY, GREY, 1.0))


def read_materials(path: str, lacking: dict[str, None]) -> dict[str, Material]:
    """The materials of a library by name; `lacking` gets what of them is not drawn."""
    with open(path, "rb") as file:
        text = file.read().decode("utf-8", "surrogateescape")
    found: dict[str, dict[str, str]] = {}
    current: dict[str, str] | None = None
    for line in text.replace("\\\n", " ").replace("\\\r\n", " ").splitlines():
        words = line.split(None, 1)
        if not words or words[0].startswith("#"):
            continue
        key, rest = words[0], words[1].strip() if len(words) > 1 else ""
        if key == "newmtl":
            current = found.setdefault(rest, {})
            current.clear()
        elif current is not None:
            current[key.lower()] = rest.split(" #")[0].strip() if key[:3] != "map" else rest
    folder = os.path.dirname(path)
    pictures: dict[tuple[Any, ...], Texture] = {}
    materials = {}
    for name, lines in found.items():
        try:
            materials[name] = _material(lines, folder, lacking, pictures)
        except MeshError as error:
            raise MeshError(f"{path!r}: material {name!r}: {error}") from None
    return materials


def _material(
    lines: dict[str, str],
    folder: str,
    lacking: dict[str, None],
    pictures: dict[tuple[Any, ...], Texture],
) -> Material:
    diffuse = _map(lines["map_kd"]) if lines.get("map_kd") else None
    opacity = next((_map(lines[key]) for key in ("map_d", "map_opacity") if lines.get(key)), None)
    usual = 1.0 if diffuse or opacity else GREY
    red, green, blue = _color(lines.get("kd"), "Kd", lacking) or (usual, usual, usual)
    alpha = 1.0
    if "d" in lines:
        alpha = _fraction(lines["d"], "d")
    elif "tr" in lines:
        alpha = 1 - _fraction(lines["tr"], "Tr")
    glow = _color(lines.get("ke"), "Ke", lacking)
    if glow and any(glow):
        lacking["emission"] = None
    if any(key in lines for key in ("map_bump", "bump", "norm", "disp")):
        lacking["bump maps"] = None
    filtered = _color(lines.get("tf"), "Tf", lacking)
    if filtered and len({*filtered, *(0.0,)}) > 1 and len({*filtered, *(1.0,)}) > 1:
        lacking["transmission (Tf)"] = None
    color = (red, green, blue, alpha)
    if diffuse is None and opacity is None:
        return Material(color)
    key = (diffuse, opacity)
    if key not in pictures:
        made = _texture(diffuse, opacity, folder, lacking)
        if made is None:
            return Material(color)
        pictures[key] = made
    lies = diffuse or opacity
    assert lies is not None
    return Material(color, pictures[key], lies.scale, lies.move)


def _texture(
    diffuse: Map | None, opacity: Map | None, folder: str, lacking: dict[str, None]
) -> Texture | None:
    color = None if diffuse is None else _picture(diffuse, folder, lacking)
    clear = color if opacity == diffuse else None
    if opacity is not None and clear is None:
        clear = _picture(opacity, folder, lacking)
    if color is None and clear is None:
        return None
    if color is None:
        assert clear is not None
        color = np.full((*clear.shape[:2], 3), 255, np.uint8)
    if opacity is not None and clear is not None:
        alpha = _as_alpha(clear)
        if alpha.shape != color.shape[:2]:  # each is stretched to the larger
            size = tuple(max(a, b) for a, b in zip(alpha.shape, color.shape[:2], strict=True))
            alpha, color = _stretched(alpha, size), _stretched(color, size)
        top = np.iinfo(color.dtype).max / np.iinfo(alpha.dtype).max
        alpha = np.rint(alpha * top).astype(color.dtype)
        color = np.concatenate([color[..., :3], alpha[..., None]], axis=2)
    lies = diffuse or opacity
    assert lies is not None
    return Texture(color, color_space="srgb", wrap="clamp" if lies.clamp else "repeat")


def _as_alpha(picture: Array) -> Array:
    """Its alpha where it has such, else how bright it is: the file's numbers, not light."""
    if picture.shape[2] == 4 and (picture[..., 3] < np.iinfo(picture.dtype).max).any():
        return picture[..., 3]
    return np.asarray(np.rint(picture[..., :3].mean(axis=2)).astype(picture.dtype))


def _stretched(picture: Array, size: tuple[int, ...]) -> Array:
    rows, columns = (
        np.minimum((np.arange(n) + 0.5) * m / n, m - 1).astype(np.int64)
        for n, m in zip(size, picture.shape[:2], strict=True)
    )
    return np.asarray(picture[rows][:, columns])


def _picture(wanted: Map, folder: str, lacking: dict[str, None]) -> Array | None:
    path = file_beside(folder, wanted.name)
    if path is None:
        lacking[f"the texture {wanted.name!r}, which is not there"] = None
        return None
    with open(path, "rb") as file:
        return decoded(file.read(), repr(path))


def file_beside(folder: str, name: str) -> str | None:
    """A file that another names: as it says, else with other slashes, else in the same folder."""
    plain = name.strip().strip('"')
    turned = plain.replace("\\", "/")
    for one in (plain, turned, os.path.basename(turned)):
        path = os.path.join(folder, one)
        if one and "\0" not in one and os.path.isfile(path):
            return path
    return None


def _map(text: str) -> Map:
    """Options and a name, which may have spaces."""
    found: dict[str, Any] = {}
    rest = text.strip()
    while rest.startswith("-"):
        words = rest.split()
        option = words[0].lower()
        if option not in OPTIONS:
            break
        values: list[str] = []
        for word in words[1 : 1 + OPTIONS[option]]:
            if OPTIONS[option] == 3 and _float(word) is None:
                break
            values.append(word)
        for word in (words[0], *values):
            rest = rest[len(word) :].lstrip()
        if option in ("-s", "-o") and values:
            usual = 1.0 if option == "-s" else 0.0
            u = _float(values[0])
            v = _float(values[1]) if len(values) > 1 else usual
            found["scale" if option == "-s" else "move"] = (u, v)
        elif option == "-clamp":
            found["clamp"] = values[:1] == ["on"]
    if not rest:
        raise MeshError(f"found {text!r:.80}; needed the name of a picture")
    return Map(rest, **found)


def _color(
    text: str | None, name: str, lacking: dict[str, None]
) -> tuple[float, float, float] | None:
    if text is None:
        return None
    words = text.split()
    if words[:1] in (["spectral"], ["xyz"]):
        lacking[f"{name} {words[0]}"] = None
        return None
    numbers = [_float(word) for word in words[:3]]
    if not numbers or any(one is None or one < 0 for one in numbers):
        raise MeshError(f"{name}: found {text!r:.80}; needed numbers that are not negative")
    red, green, blue = (one or 0.0 for one in (numbers if len(numbers) == 3 else numbers[:1] * 3))
    return red, green, blue


def _fraction(text: str, name: str) -> float:
    words = [word for word in text.split() if word != "-halo"]
    number = _float(words[0]) if words else None
    if number is None or not 0 <= number <= 1:
        raise MeshError(f"{name}: found {text!r:.80}; needed a number in [0, 1]")
    return number


def _float(word: str) -> float | None:
    try:
        number = float(word)
    except ValueError:
        return None
    return number if abs(number) < np.inf else None
