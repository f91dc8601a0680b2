"""glTF 2.0: the parts of its scene, placed, with the base colours of their materials.

As the specification of the Khronos Group has it, sections 3.5 (scenes and nodes), 3.7 (meshes),
3.8 (textures) and 3.9 (materials); of extensions those in EXTENSIONS.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import MeshError
from moit.geometry.reading.gltf_file import GltfFile
from moit.geometry.reading.json_values import Entry
from moit.geometry.reading.parts import Part
from moit.geometry.reading.pictures import decoded
from moit.geometry.textures import Texture

Array = NDArray[Any]

EXTENSIONS = (
    "KHR_texture_transform",
    "KHR_materials_unlit",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_emissive_strength",
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
)
# These change nothing that is drawn here: other choices than the file's own, and names.
WITHOUT_EFFECT = (
    "KHR_materials_variants",
    "KHR_xmp_json_ld",
    "KHR_xmp",
    "KHR_animation_pointer",
)
WRAPS = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
NEAREST, LINEAR = 9728, 9729
MIPMAPPED = (9984, 9985, 9986, 9987)
POINTS, LINES, TRIANGLES, STRIP, FAN = 0, (1, 2, 3), 4, 5, 6
# Of all instances of all meshes: a small file can ask for any number.
MOST_CORNERS = 2**27
MOST_INSTANCES = 2**18


def read_gltf(path: str) -> tuple[list[Part], list[str]]:
    """The parts of a file's scene in draw order, and what of it is not drawn.

    Raises MeshError, which does not name the file yet.
    """
    return _Scene(GltfFile(path)).read()


@dataclasses.dataclass(frozen=True)
class _Material:
    """factor : (4,) linear. uv_set, uv_matrix (2, 3) : where its texture lies. glows : colour is
    what it emits, and colours of vertices do not tint that."""

    factor: Array
    texture: Texture | None = None
    uv_set: int = 0
    uv_matrix: Array | None = None
    cutoff: float | None = None
    opaque: bool = True
    lit: bool = True
    transmission: float = 0.0
    glows: bool = False


class _Scene:
    def __init__(self, file: GltfFile) -> None:
        self.file, root = file, file.root
        self.nodes = root.entries("nodes")
        self.meshes = root.entries("meshes")
        self.materials = root.entries("materials")
        self.textures = root.entries("textures")
        self.images = root.entries("images")
        self.samplers = root.entries("samplers")
        self.skins = root.entries("skins")
        self.lacking: dict[str, None] = {}  # in the order in which they are met
        self.pictures: dict[tuple[Any, ...], Texture] = {}
        self.looks: dict[int | None, _Material] = {None: _Material(np.ones(4))}
        self.worlds: dict[int, Array] = {}  # of the scene's nodes
        self.corners = self.instances = 0

    def read(self) -> tuple[list[Part], list[str]]:
        required = [str(one) for one in self.file.root.items("extensionsRequired")]
        unknown = [one for one in required if one not in (*EXTENSIONS, *WITHOUT_EFFECT)]
        drawn = ("KHR_materials_", "KHR_lights_")  # what is warned of where it is used
        blocking = [one for one in unknown if not one.startswith(drawn)]
        if blocking:
            raise MeshError(f"needs {', '.join(blocking)}, which is not read")
        if "KHR_lights_punctual" in self.file.root.entry("extensions"):
            self.lacking["KHR_lights_punctual"] = None
        parts: list[Part] = []
        for entry, world in self._placed():
            mesh = self.meshes[entry.index("mesh", len(self.meshes))]
            worlds = self._instances(entry, world)
            for primitive in mesh.entries("primitives"):
                parts += self._parts(primitive, entry, mesh, worlds)
        return parts, list(self.lacking)

    # Nodes

    def _placed(self) -> list[tuple[Entry, Array]]:
        """The nodes of the scene that have a mesh, and their (4, 4) in it; parents first."""
        count = len(self.nodes)
        children = [node.indices("children", count) for node in self.nodes]
        parent: dict[int, int] = {}
        for i, below in enumerate(children):
            for child in below:
                if child in parent:
                    raise MeshError(f"nodes[{child}]: is a child of nodes {parent[child]} and {i}")
                parent[child] = i
        scenes = self.file.root.entries("scenes")
        if scenes:
            which = self.file.root.index("scene", len(scenes), 0)
            roots = scenes[which].indices("nodes", count)
        elif count:
            roots = [i for i in range(count) if i not in parent]
        else:
            return [(Entry({"mesh": i}), np.eye(4)) for i in range(len(self.meshes))]
        found = []
        ahead = [(i, np.eye(4)) for i in reversed(roots)]
        met: set[int] = set()
        while ahead:
            i, above = ahead.pop()
            if i in met:
                raise MeshError(f"nodes[{i}]: is in a circle of nodes, or twice in the scene")
            met.add(i)
            world = self.worlds[i] = above @ _matrix(self.nodes[i])
            if "mesh" in self.nodes[i]:
                found.append((self.nodes[i], world))
            ahead += [(child, world) for child in reversed(children[i])]
        return found

    def _instances(self, node: Entry, world: Array) -> list[Array]:
        several = node.entry("extensions").entry("EXT_mesh_gpu_instancing").entry("attributes")
        if not several.value:
            return [world]
        held = {
            name: self._attribute(several, name, width)
            for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3))
            if name in several
        }
        counts = {len(one) for one in held.values()}
        if len(counts) != 1:
            raise MeshError(f"{several.where}: found {sorted(counts)} instances; needed one number")
        count = counts.pop()
        self.instances += count
        if self.instances > MOST_INSTANCES:
            raise MeshError(f"found more than {MOST_INSTANCES} instances")
        moves = held.get("TRANSLATION", np.zeros((count, 3)))
        turns = held.get("ROTATION", np.tile([0.0, 0, 0, 1], (count, 1)))
        sizes = held.get("SCALE", np.ones((count, 3)))
        return [
            world @ _composed(*(one[i].tolist() for one in (moves, turns, sizes)))
            for i in range(count)
        ]

    # Meshes

    def _parts(self, primitive: Entry, node: Entry, mesh: Entry, worlds: list[Array]) -> list[Part]:
        mode = primitive.integer("mode", TRIANGLES)
        if mode == POINTS or mode in LINES:
            self.lacking["points" if mode == POINTS else "lines"] = None
            return []
        if mode not in (TRIANGLES, STRIP, FAN):
            raise MeshError(f"{primitive.place('mode')}: found {mode}, which is unknown")
        attributes = primitive.entry("attributes")
        if "POSITION" not in attributes:
            return []  # as the specification says
        for name in primitive.entry("extensions").value:
            if "draco" in name.lower() or "compression" in name.lower():
                raise MeshError(f"{primitive.where}: is compressed by {name}, which is not read")
        points = self._attribute(attributes, "POSITION", 3)
        normals = None
        if "NORMAL" in attributes:
            normals = self._attribute(attributes, "NORMAL", 3, len(points))
        points, normals = self._morphed(primitive, node, mesh, points, normals)
        skin = node.index("skin", len(self.skins), None)
        if skin is not None and "JOINTS_0" in attributes:
            points, normals = self._bent(self.skins[skin], attributes, points, normals)
            worlds = [np.eye(4)]  # joints alone say where it is
        triangles = self._triangles(primitive, mode, len(points))
        if not len(triangles):
            return []
        look = self._look(primitive.index("material", len(self.materials), None))
        color: Array = look.factor
        if "COLOR_0" in attributes:
            own = self._attribute(attributes, "COLOR_0", None, len(points))
            if own.shape[1] not in (3, 4):
                raise MeshError(f"{attributes.place('COLOR_0')}: has {own.shape[1]} components")
            if own.dtype.kind != "f":
                own = own / np.float64(np.iinfo(own.dtype).max)
            own = np.clip(own, 0, 1)
            if look.glows:
                own[:, :3] = 1
            color = own * look.factor[: own.shape[1]]
            if own.shape[1] == 3 and not look.opaque:
                alpha = np.full((len(points), 1), look.factor[3])
                color = np.concatenate([color, alpha], axis=1)
        if look.opaque:
            color = color[..., :3]
        uv = texture = None
        if look.texture is not None:
            name = f"TEXCOORD_{look.uv_set}"
            if name in attributes:
                texture, uv = look.texture, self._attribute(attributes, name, 2, len(points))
                if look.uv_matrix is not None:
                    uv = uv @ look.uv_matrix[:, :2].T + look.uv_matrix[:, 2]
        self._count(len(worlds) * (len(points) + 3 * len(triangles)))
        return [
            Part(
                points=_moved(points, world),
                triangles=triangles,
                color=color,
                normals=None if normals is None else _turned(normals, world),
                uv=uv,
                texture=texture,
                alpha_cutoff=look.cutoff,
                lit=look.lit,
                transmission=look.transmission,
            )
            for world in worlds
        ]

    def _count(self, corners: int) -> None:
        self.corners += corners
        if self.corners > MOST_CORNERS:
            raise MeshError(f"found more than {MOST_CORNERS} corners of triangles and instances")

    def _attribute(
        self, attributes: Entry, name: str, width: int | None, count: int | None = None
    ) -> Array:
        """(count, width) numbers."""
        found = self.file.numbers(attributes.index(name, len(self.file.accessors)))
        if width is not None and found.shape[1] != width:
            raise MeshError(
                f"{attributes.place(name)}: has {found.shape[1]} components; needed {width}"
            )
        if count is not None and len(found) != count:
            raise MeshError(f"{attributes.place(name)}: has {len(found)} elements; needed {count}")
        if found.dtype.kind == "f" and not np.isfinite(found).all():
            raise MeshError(f"{attributes.place(name)}: has numbers that are not finite")
        return found

    def _morphed(
        self, primitive: Entry, node: Entry, mesh: Entry, points: Array, normals: Array | None
    ) -> tuple[Array, Array | None]:
        """As the weights that the file gives move it; animations are not read."""
        targets = primitive.entries("targets")
        holder = node if "weights" in node else mesh
        if not targets or "weights" not in holder:
            return points, normals
        weights = holder.numbers("weights", len(targets))
        for weight, target in zip(weights, targets, strict=True):
            if weight and "POSITION" in target:
                points = points + weight * self._attribute(target, "POSITION", 3, len(points))
            if weight and normals is not None and "NORMAL" in target:
                normals = normals + weight * self._attribute(target, "NORMAL", 3, len(points))
        return points, normals

    def _bent(
        self, skin: Entry, attributes: Entry, points: Array, normals: Array | None
    ) -> tuple[Array, Array | None]:
        """As the joints lie in the scene; animations are not read."""
        joints = skin.indices("joints", len(self.nodes))
        apart = [one for one in joints if one not in self.worlds]
        if apart or not joints:
            raise MeshError(f"{skin.place('joints')}: found {apart}; needed nodes of the scene")
        bound = np.tile(np.eye(4), (len(joints), 1, 1))
        if "inverseBindMatrices" in skin:
            found = self._attribute(skin, "inverseBindMatrices", 16)
            if len(found) < len(joints):
                raise MeshError(f"{skin.place('inverseBindMatrices')}: needed {len(joints)}")
            bound = found[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
        moves = np.stack([self.worlds[one] for one in joints]) @ bound
        bend, total = np.zeros((len(points), 3, 4)), np.zeros(len(points))
        k = 0
        while f"JOINTS_{k}" in attributes:
            which = self._attribute(attributes, f"JOINTS_{k}", 4, len(points))
            weights = self._attribute(attributes, f"WEIGHTS_{k}", 4, len(points))
            if which.dtype.kind != "u" or which.max() >= len(joints):
                raise MeshError(
                    f"{attributes.place(f'JOINTS_{k}')}: needed integers below {len(joints)}"
                )
            for column in range(4):
                weight = weights[:, column].astype(np.float64)
                bend += weight[:, None, None] * moves[which[:, column], :3]
                total += weight
            k += 1
        bend /= np.where(total > 0, total, 1)[:, None, None]
        points = np.einsum("vij,vj->vi", bend[..., :3], points) + bend[..., 3]
        if normals is not None:
            normals = np.einsum("vij,vj->vi", bend[..., :3], normals)
        return points, normals

    def _triangles(self, primitive: Entry, mode: int, count: int) -> Array:
        index = primitive.index("indices", len(self.file.accessors), None)
        if index is None:
            corners: Array = np.arange(count)
        else:
            found = self.file.numbers(index)
            if found.shape[1] != 1 or found.dtype.kind != "u":
                raise MeshError(f"{primitive.place('indices')}: needed unsigned integers")
            corners = found[:, 0].astype(np.int64)
            if corners.max() >= count:
                raise MeshError(
                    f"{primitive.place('indices')}: found {corners.max()}; needed one of {count} "
                    "vertices, from 0"
                )
        if mode == TRIANGLES:
            return corners[: len(corners) // 3 * 3].reshape(-1, 3)
        if mode == FAN:
            first = np.broadcast_to(corners[:1], max(len(corners) - 2, 0))
            return np.stack([corners[1:-1], corners[2:], first], axis=1)
        found = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
        found[1::2, 1:] = found[1::2, :0:-1]  # each other triangle is turned over
        return found

    # Materials

    def _look(self, index: int | None) -> _Material:
        if index not in self.looks:
            assert index is not None
            self.looks[index] = self._material(self.materials[index])
        return self.looks[index]

    def _material(self, entry: Entry) -> _Material:
        extensions = entry.entry("extensions")
        for name in extensions.value:
            if name not in (*EXTENSIONS, *WITHOUT_EFFECT):
                self.lacking[name] = None
        lit = "KHR_materials_unlit" not in extensions
        for name in ("normalTexture", "occlusionTexture") if lit else ():
            if name in entry:
                self.lacking[name] = None
        base = entry.entry("pbrMetallicRoughness")
        keys = "baseColorFactor", "baseColorTexture"
        if "KHR_materials_pbrSpecularGlossiness" in extensions:
            base = extensions.entry("KHR_materials_pbrSpecularGlossiness")
            keys = "diffuseFactor", "diffuseTexture"
        factor = np.array(base.numbers(keys[0], 4, (1.0, 1.0, 1.0, 1.0)))
        if (factor < 0).any() or factor[3] > 1:
            raise MeshError(f"{base.place(keys[0])}: found {factor.tolist()}; needed [0, 1]")
        mode = entry.text("alphaMode", "OPAQUE")
        if mode not in ("OPAQUE", "MASK", "BLEND"):
            raise MeshError(f"{entry.place('alphaMode')}: found {mode!r:.80}, which is unknown")
        cutoff = None
        if mode == "MASK":
            cutoff = entry.number("alphaCutoff", 0.5)
            if cutoff < 0:
                raise MeshError(f"{entry.place('alphaCutoff')}: found {cutoff}; needed 0 or more")
        share = self._transmission(extensions) if cutoff is None else 0.0
        found = _Material(factor, None, 0, None, cutoff, mode == "OPAQUE", lit, share)
        glow = _glow(entry, extensions)
        if lit and glow.any():
            # nothing but emission is seen of what reflects and passes nothing
            if not factor[:3].any() and not share and (found.opaque or keys[1] not in base):
                emits = np.array([*glow, factor[3]])
                found = dataclasses.replace(found, factor=emits, lit=False, glows=True)
                return self._textured(found, entry, "emissiveTexture")
            self.lacking["emission"] = None
        return self._textured(found, base, keys[1])

    def _textured(self, found: _Material, holder: Entry, key: str) -> _Material:
        """With the texture that `holder` names by `key`, if any."""
        if key not in holder:
            return found
        info = holder.entry(key)
        texture = self._texture(info, found.opaque or found.glows)
        uv_set = info.integer("texCoord", 0)
        matrix = None
        if "KHR_texture_transform" in info.entry("extensions"):
            transform = info.entry("extensions").entry("KHR_texture_transform")
            uv_set = transform.integer("texCoord", uv_set)
            matrix = _uv_matrix(transform)
        return dataclasses.replace(found, texture=texture, uv_set=uv_set, uv_matrix=matrix)

    def _transmission(self, extensions: Entry) -> float:
        name = "KHR_materials_transmission"
        entry = extensions.entry(name)
        share = entry.number("transmissionFactor", 0.0)
        if not 0 <= share <= 1:
            raise MeshError(f"{entry.place('transmissionFactor')}: found {share}; needed [0, 1]")
        if share and "transmissionTexture" in entry:
            self.lacking[f"the texture of {name}"] = None
        return share

    def _texture(self, info: Entry, opaque: bool) -> Texture | None:
        entry = self.textures[info.index("index", len(self.textures))]
        webp = entry.entry("extensions").entry("EXT_texture_webp")
        holder = webp if "source" in webp else entry
        source = holder.index("source", len(self.images), None)
        if source is None:
            others = ", ".join(entry.entry("extensions").value) or "no image"
            self.lacking[f"a texture of {others}"] = None
            return None
        sampler = entry.index("sampler", len(self.samplers), None)
        chosen = Entry({}) if sampler is None else self.samplers[sampler]
        wrap = self._wrap(chosen, "wrapS"), self._wrap(chosen, "wrapT")
        key = (source, wrap, _filter(chosen), opaque)
        if key not in self.pictures:
            image = self.images[source]
            if "uri" in image:
                place = image.place("uri")
                content = self.file.resource(image.text("uri"), place)
            else:
                place = image.where
                content = self.file.view(image.index("bufferView", len(self.file.views)))
            pixels = decoded(content, place)
            pixels = pixels[..., :3] if opaque else pixels
            self.pictures[key] = Texture(
                pixels, color_space="srgb", wrap=wrap, filter=_filter(chosen)
            )
        return self.pictures[key]

    def _wrap(self, sampler: Entry, key: str) -> str:
        mode = sampler.integer(key, 10497)
        if mode not in WRAPS:
            raise MeshError(f"{sampler.place(key)}: found {mode}, which is unknown")
        return WRAPS[mode]


def _glow(entry: Entry, extensions: Entry) -> Array:
    """(3,) linear radiance that a material emits, but for its texture."""
    factor = np.array(entry.numbers("emissiveFactor", 3, (0.0, 0.0, 0.0)))
    if (factor < 0).any():
        raise MeshError(f"{entry.place('emissiveFactor')}: found {factor.tolist()}; needed [0, 1]")
    entry = extensions.entry("KHR_materials_emissive_strength")
    strength = entry.number("emissiveStrength", 1.0)
    if strength < 0:
        raise MeshError(f"{entry.place('emissiveStrength')}: found {strength}; needed 0 or more")
    return factor * strength


def _filter(sampler: Entry) -> str:
    """Of the two that a sampler names the one for texels larger than pixels decides: where these
    are to be seen as squares, smaller images would hide them."""
    larger = sampler.integer("magFilter", None)
    smaller = sampler.integer("minFilter", None)
    if larger not in (None, NEAREST, LINEAR):
        raise MeshError(f"{sampler.place('magFilter')}: found {larger}, which is unknown")
    if smaller not in (None, NEAREST, LINEAR, *MIPMAPPED):
        raise MeshError(f"{sampler.place('minFilter')}: found {smaller}, which is unknown")
    if larger == NEAREST or (larger is None and smaller == NEAREST):
        return "nearest"
    return "bilinear" if smaller in (NEAREST, LINEAR) else "mipmap"


def _uv_matrix(transform: Entry) -> Array:
    """(2, 3): scaled, then turned counter-clockwise as v runs down, then moved."""
    scale_u, scale_v = transform.numbers("scale", 2, (1.0, 1.0))
    move_u, move_v = transform.numbers("offset", 2, (0.0, 0.0))
    turn = transform.number("rotation", 0.0)
    c, s = math.cos(turn), math.sin(turn)
    return np.array([[c * scale_u, s * scale_v, move_u], [-s * scale_u, c * scale_v, move_v]])


def _matrix(node: Entry) -> Array:
    """(4, 4): from a node's coordinates to its parent's."""
    if "matrix" in node:
        return np.array(node.numbers("matrix", 16)).reshape(4, 4).T
    return _composed(
        node.numbers("translation", 3, (0.0, 0.0, 0.0)),
        node.numbers("rotation", 4, (0.0, 0.0, 0.0, 1.0)),
        node.numbers("scale", 3, (1.0, 1.0, 1.0)),
    )


def _composed(move: list[float], turn: list[float], size: list[float]) -> Array:
    """(4, 4) of a translation, a quaternion (x, y, z, w) and a scale."""
    length = math.hypot(*turn)
    x, y, z, w = (one / length for one in turn) if length > 0 else (0.0, 0.0, 0.0, 1.0)
    found = np.eye(4)
    found[:3, :3] = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    ) * np.array(size)
    found[:3, 3] = move
    return found


def _moved(points: Array, world: Array) -> NDArray[np.float64]:
    if (world == np.eye(4)).all():
        return points.astype(np.float64)
    return np.asarray(points.astype(np.float64) @ world[:3, :3].T + world[:3, 3])


def _turned(normals: Array, world: Array) -> Array:
    """By the inverse transposed but for a factor, which a world that is flat has too."""
    a = world[:3, :3]
    if (a == np.eye(3)).all():
        return normals
    cofactors = np.array([np.cross(a[1], a[2]), np.cross(a[2], a[0]), np.cross(a[0], a[1])])
    if np.linalg.det(a) < 0:
        cofactors = -cofactors
    size = float(np.abs(cofactors).max())
    return np.asarray(normals @ (cofactors.T / size if size > 0 else cofactors.T))
