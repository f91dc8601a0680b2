"""glTF 2.0 files: what damaged ones say."""

import json
import warnings

import numpy as np
import pytest
from gltf_files import CORNERS, SQUARE, UV, Building, png
from test_gltf import BYTES
from test_gltf_nodes import placed

import moit
from moit import MeshError


def bad_index(b):
    b.primitive["indices"] = b.accessor(np.array([0, 1, 4], "<u2"))


def without_bytes(b):
    del b.root["accessors"][0]["bufferView"]
    b.root["accessors"][0]["count"] = 2**40


def instances_without_end(b):
    b.root["accessors"].append({"componentType": 5126, "count": 2**22, "type": "VEC3"})
    extension = {"attributes": {"TRANSLATION": 2}}
    b.root["nodes"] = [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": extension}}] * 64
    b.root["scenes"] = [{"nodes": list(range(64))}]


DAMAGE = {
    "an index beyond": (bad_index, r"primitives\[0\].indices: found 4; needed one of 4"),
    "a count beyond": (
        lambda b: b.root["accessors"][0].update(count=5),
        r"accessors\[0\]: 5 elements end at byte 60 of a view of 48",
    ),
    "a huge count": (
        lambda b: b.root["accessors"][0].update(count=2**60),
        r"accessors\[0\]: \d+ elements end at",
    ),
    "a count of another kind": (
        lambda b: b.root["accessors"][0].update(count="4"),
        r"accessors\[0\].count: found '4'; needed an integer",
    ),
    "zeros without end": (without_bytes, "elements without bytes"),
    "instances without end": (instances_without_end, "found more than"),
    "a view beyond": (
        lambda b: b.root["bufferViews"][0].update(byteLength=2**40),
        r"bufferViews\[0\]: ends at byte",
    ),
    "an offset below 0": (
        lambda b: b.root["bufferViews"][0].update(byteOffset=-4),
        "byteOffset: found -4",
    ),
    "no such view": (
        lambda b: b.root["accessors"][0].update(bufferView=99),
        r"accessors\[0\].bufferView: found 99",
    ),
    "no such material": (
        lambda b: b.primitive.update(material=3),
        "material: found 3; there are none",
    ),
    "no such mesh": (lambda b: b.root.update(nodes=[{"mesh": 7}]), r"nodes\[0\].mesh: found 7"),
    "a circle": (
        lambda b: b.root.update(nodes=[{"mesh": 0, "children": [1]}, {"children": [0]}]),
        r"nodes\[0\]: is in a circle",
    ),
    "itself": (
        lambda b: b.root.update(nodes=[{"mesh": 0, "children": [0]}]),
        r"nodes\[0\]: is in a circle",
    ),
    "two parents": (
        lambda b: b.root.update(nodes=[{"children": [2]}, {"children": [2]}, {"mesh": 0}]),
        r"nodes\[2\]: is a child of nodes 0 and 1",
    ),
    "a matrix of nine": (
        lambda b: b.root.update(nodes=[{"mesh": 0, "matrix": [1] * 9}]),
        r"nodes\[0\].matrix: found .*; needed 16 numbers",
    ),
    "a number that is none": (
        lambda b: b.root.update(nodes=[{"mesh": 0, "scale": [1, float("nan"), 1]}]),
        r"nodes\[0\].scale\[1\]: found nan",
    ),
    "an unknown kind": (
        lambda b: b.root["accessors"][0].update(componentType=5130),
        "componentType: found 5130",
    ),
    "an unknown type": (lambda b: b.root["accessors"][0].update(type="VEC5"), "type: found 'VEC5'"),
    "an unknown mode": (lambda b: b.primitive.update(mode=7), "mode: found 7"),
    "a stride too small": (
        lambda b: b.root["bufferViews"][0].update(byteStride=8),
        "byteStride: 8 is less than 12",
    ),
    "an attribute of another length": (
        lambda b: b.primitive["attributes"].update(NORMAL=b.accessor(SQUARE[:3].copy())),
        "NORMAL: has 3 elements; needed 4",
    ),
    "positions in a plane": (
        lambda b: b.primitive["attributes"].update(POSITION=b.accessor(UV)),
        "POSITION: has 2 components; needed 3",
    ),
    "positions that are not finite": (
        lambda b: b.primitive["attributes"].update(
            POSITION=b.accessor(SQUARE * np.float32(np.nan))
        ),
        "POSITION: has numbers that are not finite",
    ),
    "an extension that is needed": (
        lambda b: b.root.update(extensionsRequired=["KHR_draco_mesh_compression"]),
        "needs KHR_draco_mesh_compression, which is not read",
    ),
    "compression": (
        lambda b: b.primitive.update(extensions={"KHR_draco_mesh_compression": {}}),
        "is compressed by KHR_draco_mesh_compression",
    ),
    "version 1": (lambda b: b.root.update(asset={"version": "1.0"}), "asset.version: found '1.0'"),
    "no asset": (lambda b: b.root.pop("asset"), "asset.version: needed"),
    "a list for an object": (lambda b: b.root.update(nodes=[[]]), r"nodes\[0\]: found \[\]"),
    "an alpha mode": (lambda b: b.material(alphaMode="GLASS"), "alphaMode: found 'GLASS'"),
    "a factor": (
        lambda b: b.material(pbrMetallicRoughness={"baseColorFactor": [1, 1, 1, 1.5]}),
        "baseColorFactor: found",
    ),
    "nothing": (lambda b: b.root.update(scenes=[{"nodes": []}]), "expected triangles, found none"),
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_damaged_files_say_what_is_wrong(tmp_path, kind):
    change, words = DAMAGE[kind]
    building = Building()
    change(building)
    with pytest.raises(MeshError, match=rf"file\.gltf.*{words}"):
        moit.read_mesh(building.write(tmp_path))


@pytest.mark.parametrize(
    ("uri", "words"),
    [
        ("http://example.org/a.bin", "needed data or a file beside this one"),
        ("/etc/hostname", "needed data or a file beside this one"),
        ("none.bin", "there is no file"),
        ("data:;base64,AAA", "base64 is damaged"),
        ("data:;base64,AAAA", r"buffers\[0\]: has 3 bytes; needed its byteLength"),
        ("data:nothing", "a data URI without data"),
        (None, "has no bytes"),
    ],
)
def test_buffers_that_are_not_there_say_so(tmp_path, uri, words):
    root = Building().json()
    root["buffers"][0]["uri"] = uri
    if uri is None:
        del root["buffers"][0]["uri"]
    path = tmp_path / "file.gltf"
    path.write_text(json.dumps(root))
    with pytest.raises(MeshError, match=words):
        moit.read_mesh(path)


def test_damaged_bytes_never_do_worse_than_a_mesh_error(tmp_path):
    building = Building(TEXCOORD_0=UV, COLOR_0=np.ones((4, 4), "<f4"))
    building.material(png(BYTES), {"wrapS": 33071}, alphaMode="BLEND")
    rng = np.random.default_rng(5)
    for path in (building.write(tmp_path), building.write_glb(tmp_path)):
        good = path.read_bytes()
        for _ in range(150):
            bad = bytearray(good)
            for _ in range(rng.integers(1, 6)):
                bad[rng.integers(len(bad))] = rng.integers(256)
            if rng.random() < 0.3:
                bad = bad[: rng.integers(len(bad))]
            path.write_bytes(bad)
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    moit.read_meshes(path)
            except MeshError:
                pass


def test_deep_json_is_damage(tmp_path):
    path = tmp_path / "deep.gltf"
    path.write_text("[" * 100000)
    with pytest.raises(MeshError, match="deep"):
        moit.read_mesh(path)


def test_a_long_chain_of_nodes_is_no_trouble(tmp_path):
    count = 5000
    nodes = [{"children": [i + 1], "translation": [1, 0, 0]} for i in range(count)]
    found = placed(tmp_path, [*nodes, {"mesh": 0}])
    np.testing.assert_allclose(found, SQUARE[CORNERS] + (count, 0, 0))
