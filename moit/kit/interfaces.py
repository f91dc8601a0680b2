"""What programming interfaces call formats and blend functions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

# How fragments come together: operation, source, destination.
BLENDING = {
    "add": ("add", "one", "one"),
    "max": ("max", "one", "one"),
    "multiply-complement": ("add", "zero", "one-minus-src"),
    "over": ("add", "one", "one-minus-src-alpha"),
    "under": ("add", "one-minus-dst-alpha", "one"),
    "replace": ("add", "one", "zero"),
}
INTERFACES = ("Vulkan", "Direct3D", "WebGPU", "Metal", "OpenGL")
_KEYS = [one.lower() for one in INTERFACES]
# Whose words those speak first who write a language.
OF_LANGUAGE = {
    **{"glsl": "opengl", "metal": "metal", "wgsl": "webgpu"},
    **dict.fromkeys(("hlsl", "slang"), "direct3d"),
}
_FORMATS = {
    "r32ui": ("R32_UINT", "R32_UINT", "r32uint", "R32Uint", "R32UI"),
    "r8": ("R8_UNORM", "R8_UNORM", "r8unorm", "R8Unorm", "R8"),
    "r16f": ("R16_SFLOAT", "R16_FLOAT", "r16float", "R16Float", "R16F"),
    "r32f": ("R32_SFLOAT", "R32_FLOAT", "r32float", "R32Float", "R32F"),
    "rgba16": ("R16G16B16A16_UNORM", "R16G16B16A16_UNORM", "rgba16unorm", "RGBA16Unorm", "RGBA16"),
    "rg16": ("R16G16_UNORM", "R16G16_UNORM", "rg16unorm", "RG16Unorm", "RG16"),
    "rg16f": ("R16G16_SFLOAT", "R16G16_FLOAT", "rg16float", "RG16Float", "RG16F"),
    "rg32f": ("R32G32_SFLOAT", "R32G32_FLOAT", "rg32float", "RG32Float", "RG32F"),
    "rgba16f": (
        *("R16G16B16A16_SFLOAT", "R16G16B16A16_FLOAT", "rgba16float"),
        *("RGBA16Float", "RGBA16F"),
    ),
    "rgba32f": (
        *("R32G32B32A32_SFLOAT", "R32G32B32A32_FLOAT", "rgba32float"),
        *("RGBA32Float", "RGBA32F"),
    ),
}
# Of factors and operations: Vulkan, Direct3D 12, Metal, OpenGL; WebGPU's are ours.
_FACTORS = {
    "zero": ("ZERO", "ZERO", "Zero", "ZERO"),
    "one": ("ONE", "ONE", "One", "ONE"),
    "one-minus-src": (
        *("ONE_MINUS_SRC_COLOR", "INV_SRC_COLOR"),
        *("OneMinusSourceColor", "ONE_MINUS_SRC_COLOR"),
    ),
    "one-minus-src-alpha": (
        *("ONE_MINUS_SRC_ALPHA", "INV_SRC_ALPHA"),
        *("OneMinusSourceAlpha", "ONE_MINUS_SRC_ALPHA"),
    ),
    "one-minus-dst-alpha": (
        *("ONE_MINUS_DST_ALPHA", "INV_DEST_ALPHA"),
        *("OneMinusDestinationAlpha", "ONE_MINUS_DST_ALPHA"),
    ),
}
_OPERATIONS = {"add": ("ADD", "ADD", "Add", "FUNC_ADD"), "max": ("MAX", "MAX", "Max", "MAX")}
# Where these names stand: of one target, its two factors, then its operation.
STATES = {
    "Vulkan": (
        "VkPipelineColorBlendAttachmentState: srcColorBlendFactor, dstColorBlendFactor and "
        "colorBlendOp, and those of Alpha",
        ("VK_BLEND_FACTOR_{}", "VK_BLEND_OP_{}"),
    ),
    "Direct3D": (
        "D3D12_RENDER_TARGET_BLEND_DESC: SrcBlend, DestBlend and BlendOp, and those of Alpha, "
        "whose factors end in ALPHA where these end in COLOR; with IndependentBlendEnable",
        ("D3D12_BLEND_{}", "D3D12_BLEND_OP_{}"),
    ),
    "WebGPU": (
        "GPUBlendState: srcFactor, dstFactor and operation of color and of alpha",
        ('"{}"', '"{}"'),
    ),
    "Metal": (
        "MTLRenderPipelineColorAttachmentDescriptor: sourceRGBBlendFactor, "
        "destinationRGBBlendFactor and rgbBlendOperation, and those of Alpha",
        ("MTLBlendFactor{}", "MTLBlendOperation{}"),
    ),
    "OpenGL": (
        "glBlendFunci(buffer, source, destination) and glBlendEquationi(buffer, operation)",
        ("GL_{}", "GL_{}"),
    ),
}


def blend(name: str) -> dict[str, str]:
    """As the table has it."""
    return dict(zip(("operation", "source", "destination"), BLENDING[name], strict=True))


def format_names(format: str) -> dict[str, str]:
    return dict(zip(_KEYS, _FORMATS[format], strict=True))


def blend_words(operation: str, source: str, destination: str) -> dict[str, str]:
    """A blend function as each interface writes it: both factors, and the operation."""
    rows = (_FACTORS[source], _FACTORS[destination], _OPERATIONS[operation])
    own = (source, destination, operation)
    found = {}
    for name, (_, (factor, equation)) in STATES.items():
        at = {"Vulkan": 0, "Direct3D": 1, "Metal": 2, "OpenGL": 3}.get(name)
        words = own if at is None else [row[at] for row in rows]
        ways = (factor, factor, equation)
        found[name] = ", ".join(way.format(word) for way, word in zip(ways, words, strict=True))
    return found


def blend_rows(states: Iterable[tuple[str, str, str]]) -> Iterator[tuple[str, ...]]:
    """Of each interface, where its names stand and those of each state."""
    listed = list(dict.fromkeys(states))
    for name, (where, _) in STATES.items():
        yield name, where, *(f"`{blend_words(*one)[name]}`" for one in listed)
