"""A kit in a program of wgpu: power6 by two passes and a resolve, against moit's own picture.

    python docs/kits/wgpu_panes.py

Shaders are `shaders_of`; docs/kits/webgpu_page.py puts the same into a page for a browser.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
import wgpu
from panes import BACKGROUND, FAR, HEIGHT, NEAR, WIDTH, panes, reference, vertices

import moit

VERTEX = """
struct Pane {
    @builtin(position) position: vec4f,
    @location(0) depth: f32,
    @location(1) alpha: f32,
    @location(2) color: vec3f,
}
@vertex fn pane(@location(0) place: vec2f, @location(1) depth: f32, @location(2) alpha: f32,
                @location(3) color: vec3f) -> Pane {
    return Pane(vec4f(place, 0.0, 1.0), depth, alpha, color);
}
@vertex fn whole(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}
"""
PASSES = """
struct Sums {
    @location(0) target0: vec4f,
    @location(1) target1: vec2f,
    @location(2) target2: f32,
}
@fragment fn absorbance(in: Pane) -> Sums {
    let sums = moit_accumulate(moit_warped(in.depth), in.alpha);
    return Sums(sums.target0, sums.target1, sums.target2);
}
@fragment fn shading(in: Pane) -> @location(0) vec4f {
    let pixel = moit_factor(moit_fetched(vec2<i32>(in.position.xy)));
    let through = moit_transmittance(pixel, moit_warped(in.depth), in.alpha);
    return moit_shaded(in.color, in.alpha, through);
}
@fragment fn resolve(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return moit_resolved(vec2<i32>(position.xy));
}
"""
FLOATS = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.TEXTURE_BINDING
COLUMNS = ("float32x2", "float32", "float32", "float32x3")


def exported() -> tuple[str, dict]:
    """The shaders, and the table of targets."""
    with tempfile.TemporaryDirectory() as folder:
        moit.export("power6", folder, "wgsl", depth_range=(NEAR, FAR))
        table = json.loads(Path(folder, "targets.json").read_text())
        return Path(folder, table["include"]).read_text() + VERTEX + PASSES, table


def draw(found: np.ndarray, text: str, table: dict) -> np.ndarray:
    """(HEIGHT, WIDTH, 3), linear."""
    adapter = wgpu.gpu.request_adapter_sync()
    device = adapter.request_device_sync(required_features=["float32-blendable"])
    module = device.create_shader_module(code=text)
    size = (WIDTH, HEIGHT, 1)

    def view(one: dict) -> wgpu.GPUTextureView:
        side = one.get("block_side", 1)  # of pixels that have a texel together
        own = (-(-WIDTH // side), -(-HEIGHT // side), 1)
        format = one["format"]["webgpu"]
        return device.create_texture(size=own, format=format, usage=FLOATS).create_view()

    views = {one["name"]: view(one) for one in table["targets"]}
    usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC
    picture = device.create_texture(size=size, format="rgba32float", usage=usage)
    data = vertices(found)
    geometry = device.create_buffer_with_data(data=data, usage=wgpu.BufferUsage.VERTEX)
    offsets = np.cumsum([0, 8, 4, 4])
    layout = {
        "array_stride": 28,
        "attributes": [
            {"format": kind, "offset": int(at), "shader_location": i}
            for i, (kind, at) in enumerate(zip(COLUMNS, offsets, strict=True))
        ],
    }

    def component(blend: dict) -> dict:
        factors = {"src_factor": blend["source"], "dst_factor": blend["destination"]}
        return {"operation": blend["operation"], **factors}

    def blended(format: str, blend: dict) -> dict:
        both = {"color": component(blend), "alpha": component(blend)}
        return {"format": format, "blend": both}

    encoder = device.create_command_encoder()
    known = {one["name"]: one for one in table["targets"]}
    for one in table["passes"]:
        resolves = one["name"] == "resolve"
        covers = "geometry" not in one["draws"]  # pixels, once each
        targets = [] if resolves else [known[name] for name in one["targets"]]
        states = [blended(t["format"]["webgpu"], t["blend"]) for t in targets]
        if resolves:
            states = [blended("rgba32float", one["blend"])]
        pipeline = device.create_render_pipeline(
            layout="auto",
            vertex={
                "module": module,
                "entry_point": "whole" if covers else "pane",
                "buffers": [] if covers else [layout],
            },
            fragment={"module": module, "entry_point": one["name"], "targets": states},
        )
        drawn = [(views[t["name"]], (t["clear"],) * 4) for t in targets]
        if resolves:
            drawn = [(picture.create_view(), (*BACKGROUND, 1.0))]
        render = encoder.begin_render_pass(
            color_attachments=[
                {"view": view, "clear_value": clear, "load_op": "clear", "store_op": "store"}
                for view, clear in drawn
            ]
        )
        render.set_pipeline(pipeline)
        if one["reads"]:
            entries = [
                {"binding": table["bindings"][name], "resource": views[name]}
                for name in one["reads"]
            ]
            group = pipeline.get_bind_group_layout(0)
            render.set_bind_group(0, device.create_bind_group(layout=group, entries=entries))
        if not covers:
            render.set_vertex_buffer(0, geometry)
        render.draw(3 if covers else len(data))
        render.end()
    device.queue.submit([encoder.finish()])
    rows = device.queue.read_texture(
        {"texture": picture}, {"bytes_per_row": WIDTH * 16, "rows_per_image": HEIGHT}, size
    )
    return np.frombuffer(rows, np.float32).reshape(HEIGHT, WIDTH, 4)[..., :3]


def main() -> float:
    """The largest difference from moit's picture."""
    found = panes()
    difference = np.abs(draw(found, *exported()) - reference("power6(bias=4e-6)", found)).max()
    print(f"power6 in WGSL by wgpu: off from moit's picture by at most {difference:.1e}")
    return float(difference)


if __name__ == "__main__":
    main()
