"""The programs of docs/kits draw what moit draws."""

import importlib
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from readings import kit_runners

import moit

FOLDER = Path(__file__).parents[1] / "docs" / "kits"
HALF = 2e-3  # two dozen fragments, each rounded into a target of half floats


@pytest.fixture
def example(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module


def test_moderngl_draws_what_moit_does(example):
    pytest.importorskip("moderngl", reason="needs moderngl (PyPI)")
    kit_runners.software_device()  # or skip, where there is no EGL
    assert example("moderngl_panes").main() < HALF


def test_wgpu_draws_what_moit_does(example):
    device = kit_runners.wgpu_device()
    if "float32-blendable" not in device.features:
        pytest.skip("this driver does not blend targets of 32-bit floats")
    assert example("wgpu_panes").main() < HALF


# Two passes of moments of blocks, and a pass that reads between them.
SMALL = """
struct Small { @location(0) moments: vec4f, @location(1) total: f32 }
@fragment fn absorbance(in: Pane) -> Small {
    let sums = moit_accumulate(moit_warped(in.depth), in.alpha);
    return Small(sums.target0, sums.target1);
}
@fragment fn second_absorbance(in: Pane) -> Small {
    let first = moit_factor(moit_fetched_texel(vec2<i32>(in.position.xy)));
    let seconds = moit_accumulate_second(first, moit_warped(in.depth), in.alpha);
    return Small(seconds.target2, seconds.target3);
}
struct Shaded { @location(0) color: vec4f, @location(1) alpha: f32 }
@fragment fn shading(in: Pane) -> Shaded {
    let p = vec2<i32>(in.position.xy);
    let pixel = moit_factor_second(moit_fetched(p), moit_fetched_second(p));
    let through = moit_transmittance(pixel, moit_warped(in.depth), in.alpha);
    return Shaded(moit_shaded(in.color, in.alpha, through), in.alpha);
}
@fragment fn resolve(@builtin(position) position: vec4f) -> @location(0) vec4f {
    return moit_resolved(vec2<i32>(position.xy));
}
"""


def test_small_targets_are_read_between_their_texels(example, tmp_path):
    device = kit_runners.wgpu_device()
    if "float32-blendable" not in device.features:
        pytest.skip("this driver does not blend targets of 32-bit floats")
    program, panes = example("wgpu_panes"), example("panes")
    near_far = panes.NEAR, panes.FAR
    moit.export("two-moments-pass-lr8", tmp_path, "wgsl", depth_range=near_far)
    table = json.loads((tmp_path / "targets.json").read_text())
    # panes cover whole pixels, and the middles of blocks are pixels' corners: as in the core they
    # see what the pixel right of and below them does
    table["passes"] = [
        one | {"name": one["name"].replace(" ", "_")}
        for one in table["passes"]
        if one["name"] != "farthest"  # nothing here is opaque
    ]
    text = (tmp_path / table["include"]).read_text() + program.VERTEX + SMALL
    found = panes.panes()
    technique = f"two-moments-pass(resolution=8,bias={kits_bias(table)})"
    drawn = program.draw(found, text, table)
    assert np.abs(drawn - panes.reference(technique, found)).max() < HALF
    at_full = panes.reference("two-moments-pass", found)
    assert np.abs(drawn - at_full).max() > 10 * HALF  # which small targets can not give


# Moments of blocks that are means, and a pixel's own total.
MEANS = """
struct Sums { @location(0) a: vec4f, @location(1) b: f32 }
@fragment fn absorbance(in: Pane) -> Sums {
    let sums = moit_accumulate(moit_warped(in.depth), in.alpha);
    return Sums(sums.target0, sums.target1);
}
@fragment fn means(@builtin(position) position: vec4f) -> Sums {
    let mean = moit_mean(vec2<i32>(position.xy));
    return Sums(mean.target0, mean.target1);
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


@pytest.mark.parametrize("side", [3, 7])  # whose last blocks are cut
def test_blocks_are_means_of_their_pixels(side, example, tmp_path):
    device = kit_runners.wgpu_device()
    if "float32-blendable" not in device.features:
        pytest.skip("this driver does not blend targets of 32-bit floats")
    program, panes = example("wgpu_panes"), example("panes")
    name = f"power4(resolution={side},total='full'"
    moit.export(f"{name})", tmp_path, "wgsl", depth_range=(panes.NEAR, panes.FAR))
    table = json.loads((tmp_path / "targets.json").read_text())
    found = panes.panes()
    drawn = program.draw(
        found, (tmp_path / table["include"]).read_text() + program.VERTEX + MEANS, table
    )
    exact = panes.reference(f"{name},bias={kits_bias(table)})", found)
    assert np.abs(drawn - exact).max() < HALF
    assert np.abs(drawn - panes.reference("power4", found)).max() > 10 * HALF


def kits_bias(table) -> str:
    return next(one["value"] for one in table["options"] if one["name"] == "MOIT_BIAS")


def test_the_panes_overlap_and_are_seen(example):
    panes = example("panes")
    found = panes.panes()
    picture = panes.reference("sorted", found)
    assert np.abs(picture - panes.BACKGROUND).mean() > 0.1
    assert np.abs(picture - panes.reference("weighted-average", found)).max() > 0.05


def test_the_page_for_browsers_has_all_it_needs(example):
    kit_runners.wgpu_device()
    text = example("webgpu_page").page()
    assert not re.search(r"(src|href)=|https?:|import\(|fetch\(", text)
    kit = json.loads(text.partition("const kit = ")[2].partition(";\n")[0].replace("<\\/", "</"))
    kit_runners.wgpu_device().create_shader_module(code=kit["shaders"])
    entries = re.findall(r"@(?:vertex|fragment) fn (\w+)", kit["shaders"])
    assert {one["name"] for one in kit["table"]["passes"]} <= set(entries)
    assert {"pane", "whole"} <= set(entries)
    assert text.index("async function draw()") > 0 and "\ndraw();\n" in text


def test_the_script_of_the_page_is_javascript():
    node = shutil.which("node")
    if not node:
        pytest.skip("needs node (Debian's nodejs)")
    subprocess.run([node, "--check", FOLDER / "webgpu_page.js"], check=True)
