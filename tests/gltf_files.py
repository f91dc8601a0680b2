"""glTF files in the making, for the suites that read them."""

import base64
import io
import json
import struct

import numpy as np
import pytest

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "<f4")


CORNERS = np.array([0, 1, 2, 0, 2, 3], "<u2")


UV = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "<f4")


TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}


SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Building:
    """A glTF file in the making: one mesh of one primitive at one node, to be changed."""

    def __init__(self, **attributes):
        self.bytes = bytearray()
        self.root = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "accessors": [],
            "bufferViews": [],
        }
        attributes = {"POSITION": SQUARE} | attributes
        held = {name: self.accessor(one) for name, one in attributes.items()}
        self.primitive = {"attributes": held, "indices": self.accessor(CORNERS)}
        self.root["meshes"] = [{"primitives": [self.primitive]}]

    def view(self, content, **options):
        self.bytes += bytes(-len(self.bytes) % 4)
        place = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(content)}
        self.root["bufferViews"].append(place | options)
        self.bytes += content
        return len(self.root["bufferViews"]) - 1

    def accessor(self, array, **options):
        array = np.asarray(array)
        width = 1 if array.ndim == 1 else array.shape[1]
        one = {
            "bufferView": self.view(array.tobytes()),
            "componentType": TYPES[array.dtype.str[1:]],
            "count": len(array),
            "type": SHAPES[width],
        }
        self.root["accessors"].append(one | options)
        return len(self.root["accessors"]) - 1

    def material(self, texture=None, sampler=None, info=None, **material):
        material.setdefault("pbrMetallicRoughness", {})
        self.root["materials"] = [*self.root.get("materials", []), material]
        self.primitive["material"] = len(self.root["materials"]) - 1
        if texture is not None:
            self.root["images"] = [{"bufferView": self.view(texture), "mimeType": "image/png"}]
            self.root["textures"] = [{"source": 0} | ({"sampler": 0} if sampler else {})]
            if sampler:
                self.root["samplers"] = [sampler]
            material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0} | (info or {})
        return self

    def json(self):
        data = base64.b64encode(self.bytes).decode()
        uri = f"data:application/octet-stream;base64,{data}"
        return self.root | {"buffers": [{"byteLength": len(self.bytes), "uri": uri}]}

    def write(self, folder, name="file.gltf"):
        path = folder / name
        path.write_text(json.dumps(self.json()))
        return path

    def write_glb(self, folder):
        root = self.root | {"buffers": [{"byteLength": len(self.bytes)}]}
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.bytes) + bytes(-len(self.bytes) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
        path = folder / "file.glb"
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path


def png(pixels):
    image = pytest.importorskip("PIL.Image", reason="no Pillow, so no textures")
    held = io.BytesIO()
    image.fromarray(np.asarray(pixels, np.uint8)).save(held, "png")
    return held.getvalue()
