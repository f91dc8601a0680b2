"""What a Vulkan driver says of a compute shader that it has compiled, by ctypes alone.

VK_KHR_pipeline_executable_properties tells of compiled code. Mesa's radv makes devices of no
hardware where RADV_FORCE_FAMILY names one: its compiler, the one that games run on, then does all
that it does on a machine that has such a GPU.

    python -m moit.gpu_costs.vulkan < list of SPIR-V files, one a line

prints a line of JSON: {"device", "driver"}, and one for each file: {"subgroup", statistics by the
driver's names}. It is a process of its own since a driver that does not like a shader may end it.
"""

from __future__ import annotations

import ctypes
import json
import sys
from ctypes import POINTER, byref, c_char, c_char_p, c_float, c_int32, c_uint32, c_uint64, c_void_p
from pathlib import Path
from typing import Any

BINDINGS = 64  # storage buffers of set 0 that a shader may use
STATISTICS = 64
EXTENSION = b"VK_KHR_pipeline_executable_properties"
COMPUTE = 0x20  # VK_SHADER_STAGE_COMPUTE_BIT
STORAGE_BUFFER = 7  # VK_DESCRIPTOR_TYPE_STORAGE_BUFFER
CAPTURE_STATISTICS = 0x40
FEATURES = 55  # members of VkPhysicalDeviceFeatures
FLOAT64 = 39  # which of them is shaderFloat64
INCOMPLETE = 5


class Info(ctypes.Structure):
    """What every structure of Vulkan begins with."""

    kind: int
    _fields_ = [("sType", c_uint32), ("pNext", c_void_p)]

    def __init__(self, **values: Any) -> None:
        super().__init__(sType=self.kind, **values)


class Application(Info):
    kind = 0
    _fields_ = [
        ("name", c_char_p),
        ("version", c_uint32),
        ("engine", c_char_p),
        ("engine_version", c_uint32),
        ("api", c_uint32),
    ]


class Instance(Info):
    kind = 1
    _fields_ = [
        ("flags", c_uint32),
        ("application", c_void_p),
        ("layer_count", c_uint32),
        ("layers", c_void_p),
        ("extension_count", c_uint32),
        ("extensions", c_void_p),
    ]


class Queue(Info):
    kind = 2
    _fields_ = [
        ("flags", c_uint32),
        ("family", c_uint32),
        ("count", c_uint32),
        ("priorities", POINTER(c_float)),
    ]


class Device(Info):
    kind = 3
    _fields_ = [
        ("flags", c_uint32),
        ("queue_count", c_uint32),
        ("queues", c_void_p),
        ("layer_count", c_uint32),
        ("layers", c_void_p),
        ("extension_count", c_uint32),
        ("extensions", POINTER(c_char_p)),
        ("features", POINTER(c_uint32)),
    ]


class ExecutableFeature(Info):
    kind = 1000269000
    _fields_ = [("pipelineExecutableInfo", c_uint32)]


class Module(Info):
    kind = 16
    _fields_ = [("flags", c_uint32), ("size", ctypes.c_size_t), ("code", c_char_p)]


class Binding(ctypes.Structure):
    _fields_ = [
        ("binding", c_uint32),
        ("type", c_uint32),
        ("count", c_uint32),
        ("stages", c_uint32),
        ("samplers", c_void_p),
    ]


class SetLayout(Info):
    kind = 32
    _fields_ = [("flags", c_uint32), ("count", c_uint32), ("bindings", POINTER(Binding))]


class Layout(Info):
    kind = 30
    _fields_ = [
        ("flags", c_uint32),
        ("set_count", c_uint32),
        ("sets", POINTER(c_uint64)),
        ("range_count", c_uint32),
        ("ranges", c_void_p),
    ]


class Stage(Info):
    kind = 18
    _fields_ = [
        ("flags", c_uint32),
        ("stage", c_uint32),
        ("module", c_uint64),
        ("name", c_char_p),
        ("specialization", c_void_p),
    ]


class Pipeline(Info):
    kind = 29
    _fields_ = [
        ("flags", c_uint32),
        ("stage", Stage),
        ("layout", c_uint64),
        ("base", c_uint64),
        ("base_index", c_int32),
    ]


class OfPipeline(Info):
    kind = 1000269001  # VkPipelineInfoKHR
    _fields_ = [("pipeline", c_uint64)]


class OfExecutable(Info):
    kind = 1000269003  # VkPipelineExecutableInfoKHR
    _fields_ = [("pipeline", c_uint64), ("index", c_uint32)]


class Executable(Info):
    kind = 1000269002  # VkPipelineExecutablePropertiesKHR
    _fields_ = [
        ("stages", c_uint32),
        ("name", c_char * 256),
        ("description", c_char * 256),
        ("subgroup", c_uint32),
    ]


class Statistic(Info):
    kind = 1000269004
    _fields_ = [
        ("name", c_char * 256),
        ("description", c_char * 256),
        ("format", c_uint32),
        ("value", c_uint64),
    ]


class VulkanError(RuntimeError):
    """A call failed; the message names it."""


def _library() -> ctypes.CDLL:
    try:
        return ctypes.CDLL("libvulkan.so.1")
    except OSError as error:
        raise VulkanError(f"libvulkan.so.1 cannot be loaded: {error}") from None


class Compiler:
    """A device, and what it makes of shaders."""

    def __init__(self) -> None:
        self._vulkan = _library()
        application = Application(api=(1 << 22) | (2 << 12))
        made = Instance(application=ctypes.addressof(application))
        self._instance = c_void_p()
        self._call("vkCreateInstance", byref(made), None, byref(self._instance))
        hardware, found = (c_void_p * 1)(), c_uint32(1)
        self._call(
            "vkEnumeratePhysicalDevices", self._instance, byref(found), hardware, more=INCOMPLETE
        )
        if not found.value:
            raise VulkanError("the driver has no device: it does not know the family")
        self._describe(c_void_p(hardware[0]))
        self._open(c_void_p(hardware[0]))
        self._make_layout()

    def _call(self, name: str, *arguments: Any, more: int = 0) -> None:
        """more : another code than 0 that is no failure."""
        function = getattr(self._vulkan, name)
        function.restype = c_int32
        result = function(*arguments)
        if result not in (0, more):
            raise VulkanError(f"{name} failed with {result}")

    def _describe(self, hardware: c_void_p) -> None:
        told = ctypes.create_string_buffer(4096)  # VkPhysicalDeviceProperties has 824 bytes
        describe = self._vulkan.vkGetPhysicalDeviceProperties
        describe.restype = None
        describe(hardware, told)
        version = int.from_bytes(told.raw[4:8], sys.byteorder)
        self.driver = f"{version >> 22}.{version >> 12 & 0x3FF}.{version & 0xFFF}"
        self.name = told.raw[20:276].partition(b"\0")[0].decode("utf-8", "replace")

    def _open(self, hardware: c_void_p) -> None:
        priority = c_float(1.0)
        queue = Queue(count=1, priorities=ctypes.pointer(priority))
        feature = ExecutableFeature(pipelineExecutableInfo=1)
        features = (c_uint32 * FEATURES)()
        features[FLOAT64] = 1
        extensions = (c_char_p * 1)(EXTENSION)
        made = Device(
            pNext=ctypes.addressof(feature),
            queue_count=1,
            queues=ctypes.addressof(queue),
            extension_count=1,
            extensions=extensions,
            features=features,
        )
        self._device = c_void_p()
        self._call("vkCreateDevice", hardware, byref(made), None, byref(self._device))

    def _make_layout(self) -> None:
        bindings = (Binding * BINDINGS)(
            *(Binding(i, STORAGE_BUFFER, 1, COMPUTE, None) for i in range(BINDINGS))
        )
        layout, self._layout = c_uint64(), c_uint64()
        made = SetLayout(count=BINDINGS, bindings=bindings)
        self._call("vkCreateDescriptorSetLayout", self._device, byref(made), None, byref(layout))
        whole = Layout(set_count=1, sets=ctypes.pointer(layout))
        self._call("vkCreatePipelineLayout", self._device, byref(whole), None, byref(self._layout))

    def statistics(self, code: bytes) -> dict[str, int]:
        """By the driver's names, and "subgroup", the threads of a wave."""
        module, pipeline = c_uint64(), c_uint64()
        text = Module(size=len(code), code=code)
        self._call("vkCreateShaderModule", self._device, byref(text), None, byref(module))
        made = Pipeline(
            flags=CAPTURE_STATISTICS,
            stage=Stage(stage=COMPUTE, module=module.value, name=b"main"),
            layout=self._layout.value,
        )
        self._call(
            "vkCreateComputePipelines",
            self._device,
            c_uint64(0),
            c_uint32(1),
            byref(made),
            None,
            byref(pipeline),
        )
        found = {"subgroup": self._subgroup(pipeline)} | self._told(pipeline)
        for destroy, what in (("vkDestroyPipeline", pipeline), ("vkDestroyShaderModule", module)):
            function = getattr(self._vulkan, destroy)
            function.restype = None
            function(self._device, what, None)
        return found

    def _extension(self, name: str, *arguments: Any) -> None:
        get = self._vulkan.vkGetDeviceProcAddr
        get.restype = c_void_p
        address = get(self._device, name.encode())
        if not address:
            raise VulkanError(f"the driver has no {name}")
        result = ctypes.CFUNCTYPE(c_int32, c_void_p, c_void_p, c_void_p, c_void_p)(address)(
            self._device, *arguments
        )
        if result not in (0, INCOMPLETE):
            raise VulkanError(f"{name} failed with {result}")

    def _subgroup(self, pipeline: c_uint64) -> int:
        one, count = Executable(), c_uint32(1)
        of = OfPipeline(pipeline=pipeline.value)
        name = "vkGetPipelineExecutablePropertiesKHR"
        self._extension(name, byref(of), byref(count), byref(one))
        if count.value != 1:
            raise VulkanError(f"{name}: expected one executable, got {count.value}")
        return int(one.subgroup)

    def _told(self, pipeline: c_uint64) -> dict[str, int]:
        found, count = (Statistic * STATISTICS)(), c_uint32(STATISTICS)
        for one in found:
            one.sType = Statistic.kind
        of = OfExecutable(pipeline=pipeline.value)
        name = "vkGetPipelineExecutableStatisticsKHR"
        self._extension(name, byref(of), byref(count), found)
        return {one.name.decode("utf-8", "replace"): int(one.value) for one in found[: count.value]}


def main() -> None:
    try:
        compiler = Compiler()
        print(json.dumps({"device": compiler.name, "driver": compiler.driver}), flush=True)
        for line in sys.stdin:
            code = Path(line.rstrip("\n")).read_bytes()
            print(json.dumps(compiler.statistics(code)), flush=True)
    except VulkanError as error:
        print(json.dumps({"error": str(error)}), flush=True)


if __name__ == "__main__":
    main()
