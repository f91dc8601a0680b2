"""Files that are damaged at random, put to whatever reads files.

`python tests/hostile_files.py --seconds 600` damages good files of every kind in a process of its
own, and says of each number, which is a seed, what was raised that is not moit's own error with the
file's name, what took long, or that the process ended: `--case NUMBER` tries that one alone.
"""

import argparse
import base64
import io
import json
import random
import resource
import struct
import subprocess
import sys
import tempfile
import time
import warnings
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

import moit
from moit.checks.exceptions import MoitError
from moit.formats.images import read_image
from moit.neural import checkpoint
from moit.neural.fitting import State

PLAN = {"sizes": [3, 8, 1], "seed": 1}
LONG = 10.0  # seconds that no small file may take
MUCH = 1 << 30  # bytes that none may

READERS = {
    "fragments": moit.load,
    "network": moit.Network.read,
    "checkpoint": lambda path: checkpoint.read(path, PLAN),
}
FIRST = {"fragments": "depth", "network": "weights0", "checkpoint": "parameters"}


def written(reader: str, path: Path) -> dict:
    """A good file, and its arrays."""
    if reader == "fragments":
        moit.save(path, moit.scenes.load("panes", (4, 3)))
    elif reader == "network":
        moit.Network.shipped("neural-bounded").write(path)
    else:
        state = State.start((3, 8, 1), 0)
        state.losses.append((0.5, 0.25))
        checkpoint.write(path, state, PLAN)
    with np.load(path) as archive:
        return dict(archive)


def packed(path: Path, arrays: dict, method: int = zipfile.ZIP_DEFLATED, **raw: bytes) -> None:
    """An archive of arrays, and of members given as they are."""
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, array in arrays.items():
            content = io.BytesIO()
            npy.write_array(content, np.asanyarray(array))
            archive.writestr(f"{name}.npy", content.getvalue())
        for name, content in raw.items():
            archive.writestr(f"{name}.npy", content)


def mutated(content: bytes, r: random.Random) -> bytes:
    b = bytearray(content)
    for _ in range(r.choice((1, 1, 1, 2, 3, 8))):
        at, kind = r.randrange(max(len(b), 1)), r.randrange(6)
        if r.random() < 0.4:
            at = min(at, r.randrange(600))
        end = at + r.choice((1, 4, 8, 50, 500))
        if kind == 0:
            b[at:end] = b""
        elif kind == 1:
            b[at:at] = b[at:end]
        elif kind == 2:
            number = r.choice((0, 1, 2**15, 2**30, 2**31 - 1, 2**32 - 1, 2**63 - 1, 2**64 - 1))
            width = r.choice((2, 4, 8))
            number %= 1 << 8 * width
            b[at : at + width] = number.to_bytes(width, r.choice(("little", "big")))
        elif kind == 3 and r.random() < 0.5:
            b = b[:at]
        elif at < len(b):
            b[at] ^= 1 << r.randrange(8)
    return bytes(b)


def mesh_files() -> list[tuple[str, bytes]]:
    ply = (
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    stl = bytes(80) + struct.pack("<I12fH", 1, *(0, 0, 1), *(0, 0, 0), *(1, 0, 0), *(0, 1, 0), 0)
    obj = "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n"
    off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    data = struct.pack("<9f3H", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 2)
    told = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
             "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }  # fmt: skip
    text = json.dumps(told).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    glb = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data))
    glb += struct.pack("<I4s", len(text), b"JSON") + text
    glb += struct.pack("<I4s", len(data), b"BIN\0") + data
    named = {"ply": ply.encode(), "stl": stl, "obj": obj.encode(), "off": off.encode(), "glb": glb}
    return [(f"a.{ending}", content) for ending, content in named.items()]


def textured(folder: Path) -> bytes:
    """A glTF of one triangle with a texture, whose buffers and image it has in itself."""

    def inside(kind: str, content: bytes) -> str:
        return f"data:{kind};base64," + base64.b64encode(content).decode()

    moit.write_image(folder / "good.png", np.random.default_rng(3).random((5, 4, 4)))
    data = struct.pack("<15f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1)
    view = {"buffer": 0, "byteOffset": 0, "byteLength": 36}
    accessor = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    told = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data), "uri": inside("application/octet-stream", data)}],
        "bufferViews": [view, {**view, "byteOffset": 36, "byteLength": 24}],
        "accessors": [
            {**accessor, "min": [0, 0, 0], "max": [1, 1, 0]},
            {**accessor, "bufferView": 1, "type": "VEC2"},
        ],
        "images": [{"uri": inside("image/png", (folder / "good.png").read_bytes())}],
        "samplers": [{"magFilter": 9728, "wrapS": 33071}],
        "textures": [{"source": 0, "sampler": 0}],
        "materials": [
            {
                "pbrMetallicRoughness": {
                    "baseColorTexture": {"index": 0},
                    "baseColorFactor": [1, 0.5, 0.2, 0.8],
                },
                "alphaMode": "BLEND",
                "emissiveFactor": [0.1, 0.2, 0.3],
            }
        ],
        "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
        "nodes": [{"mesh": 0, "translation": [0, 0, 5]}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    return json.dumps(told).encode()


MATERIALS = """newmtl red
Kd 1 0 0
d 0.5
map_Kd a.png
newmtl glass
Kd 0.2 0.4 0.6
Tr 0.25
"""


def with_materials(path: Path) -> moit.Mesh:
    """Of an OBJ beside `path`, which is a library of materials."""
    obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
    obj += "usemtl red\nf 1/1 2/2 3/3\nusemtl glass\nf 1/1 3/3 2/2\n"
    path.with_name("a.obj").write_text(obj)
    return moit.read_mesh(path.with_name("a.obj"))


def volumes() -> moit.Fragments:
    rng = np.random.default_rng(4)
    depth = rng.uniform(1, 9, 60)
    return moit.Fragments(
        np.arange(0, 61, 5),
        depth,
        rng.random(60) * 0.9,
        rng.random((60, 3)),
        back=depth + rng.random(60),
        transmission=rng.random((60, 3)),
        shape=(3, 4),
        dtype=np.float32,
    )


def good_files(kind: str, folder: Path) -> list[tuple[str, bytes]]:
    if kind in READERS:
        arrays = written(kind, folder / "good.npz")
        files = [("a.npz", (folder / "good.npz").read_bytes())]
        packed(folder / "good.npz", arrays)
        return [*files, ("a.npz", (folder / "good.npz").read_bytes())]
    if kind in ("deep", "bands"):
        files = []
        for name, half in (("panes", False), ("cloud", True)):
            moit.write_deep(folder / "good.exr", moit.scenes.load(name, (9, 7)), half=half)
            files.append(("a.exr", (folder / "good.exr").read_bytes()))
        moit.write_deep(folder / "good.exr", volumes())
        return [*files, ("a.exr", (folder / "good.exr").read_bytes())]
    if kind == "materials":
        return [("a.mtl", MATERIALS.encode())]
    if kind == "image":
        files, image = [], np.random.default_rng(2).random((9, 11, 4), np.float32)
        for compression in ("zip", "piz", "dwaa", "b44", "rle"):
            told = {"compression": compression}
            moit.write_image(folder / "good.exr", image, attributes=told, half=True)
            files.append(("a.exr", (folder / "good.exr").read_bytes()))
        moit.write_image(folder / "good.png", image)
        return [*files, ("a.png", (folder / "good.png").read_bytes())]
    return [*mesh_files(), ("a.gltf", textured(folder))]


MUTATED = {
    **READERS,
    "deep": moit.read_deep,
    "bands": lambda path: list(moit.read_deep_bands(path)),
    "image": read_image,
    "mesh": moit.read_mesh,
    "materials": with_materials,
}
KINDS = tuple(MUTATED)


@cache
def files_of(kind: str) -> list[tuple[str, bytes]]:
    with tempfile.TemporaryDirectory() as folder:
        return good_files(kind, Path(folder))


def tried(number: int, folder: Path) -> tuple[bool, list[str]]:
    """Whether a damaged file was read all the same; and what its reader breaks, in words."""
    kind, r = KINDS[number % len(KINDS)], random.Random(number)
    files = files_of(kind)
    name, content = files[number // len(KINDS) % len(files)]
    path, begun = folder / name, time.monotonic()
    path.write_bytes(mutated(content, r))
    read, found = False, []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            MUTATED[kind](path)
        read = True
    except (MoitError, OSError, ValueError) as error:
        if not isinstance(error, (MoitError, OSError)) and kind != "image":
            found.append(f"{kind}: {error!r} is not moit's own")
        names = (path.name, "a.obj") if kind == "materials" else (path.name,)
        if not any(name in str(error) for name in names):
            found.append(f"{kind}: {error!r} does not name the file")
    except Exception as error:
        found.append(f"{kind}: {error!r} is not moit's own")
    if (took := time.monotonic() - begun) > LONG:
        found.append(f"{kind}: it took {took:.1f} s")
    return read, found


# ---- Long runs -----------------------------------------------------------------------------------


def _run(first: int, seconds: float, count: int, progress: Path) -> None:
    """Tries numbers from `first` on until the time is over; the file names the present one."""
    end, last = time.monotonic() + seconds, first + count
    used, reads = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, 0
    with progress.open("r+") as file, tempfile.TemporaryDirectory() as folder:
        while first < last and time.monotonic() < end:
            file.seek(0)
            file.write(f"{first:020d}")
            file.flush()
            read, found = tried(first, Path(folder))
            reads += read
            for what in found:
                print(f"file {first}: {what}", flush=True)
            most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            if (most - used) * 1024 > MUCH:
                print(f"file {first}: {(most - used) >> 10} MB more", flush=True)
                used = most
            first += 1
    print(f"{reads} were read all the same", flush=True)


def _watch(first: int, seconds: float, count: int) -> None:
    """Tries files in processes of their own, each from where the one before it died."""
    end, begun, last = time.monotonic() + seconds, first, first + count
    with tempfile.TemporaryDirectory() as folder:
        progress = Path(folder) / "file"
        while first < last and (left := end - time.monotonic()) > 0:
            progress.write_text(f"{first:020d}")
            command = [sys.executable, __file__, "--first", str(first), "--seconds", str(left)]
            command += ["--count", str(last - first), "--progress", str(progress)]
            died = subprocess.run(command, stderr=subprocess.DEVNULL).returncode
            first = int(progress.read_text()) + 1
            if died:
                print(f"file {first - 1}: the process ended with {died}", flush=True)
    print(f"{first - begun} files", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description="Damages files, and reads them.")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--count", type=int, default=1 << 40, help="no more files than that")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--case", type=int)
    parser.add_argument("--progress", type=Path, help="for the process that tries them")
    asked = parser.parse_args()
    if asked.case is not None:
        with tempfile.TemporaryDirectory() as folder:
            print(tried(asked.case, Path(folder)))
    elif asked.progress:
        _run(asked.first, asked.seconds, asked.count, asked.progress)
    else:
        _watch(asked.first, asked.seconds, asked.count)


if __name__ == "__main__":
    main()
