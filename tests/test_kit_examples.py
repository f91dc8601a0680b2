"""The programs of docs/kits draw what moit draws."""

import importlib
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from readings import kits

FOLDER = Path(__file__).parents[1] / "docs" / "kits"
HALF = 2e-3  # two dozen fragments, each rounded into a target of half floats


@pytest.fixture
def example(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module


def test_moderngl_draws_what_moit_does(example):
    pytest.importorskip("moderngl", reason="needs moderngl (PyPI)")
    kits.software_device()  # or skip, where there is no EGL
    assert example("moderngl_panes").main() < HALF


def test_wgpu_draws_what_moit_does(example):
    device = kits.wgpu_device()
    if "float32-blendable" not in device.features:
        pytest.skip("this driver does not blend targets of 32-bit floats")
    assert example("wgpu_panes").main() < HALF


def test_the_panes_overlap_and_are_seen(example):
    panes = example("panes")
    found = panes.panes()
    picture = panes.reference("sorted", found)
    assert np.abs(picture - panes.BACKGROUND).mean() > 0.1
    assert np.abs(picture - panes.reference("weighted-average", found)).max() > 0.05


def test_the_page_for_browsers_has_all_it_needs(example):
    kits.wgpu_device()
    text = example("webgpu_page").page()
    assert not re.search(r"(src|href)=|https?:|import\(|fetch\(", text)
    kit = json.loads(text.partition("const kit = ")[2].partition(";\n")[0].replace("<\\/", "</"))
    kits.wgpu_device().create_shader_module(code=kit["shaders"])
    entries = re.findall(r"@(?:vertex|fragment) fn (\w+)", kit["shaders"])
    assert {one["name"] for one in kit["table"]["passes"]} <= set(entries)
    assert {"pane", "whole"} <= set(entries)
    assert text.index("async function draw()") > 0 and "\ndraw();\n" in text


def test_the_script_of_the_page_is_javascript():
    node = shutil.which("node")
    if not node:
        pytest.skip("needs node (Debian's nodejs)")
    subprocess.run([node, "--check", FOLDER / "webgpu_page.js"], check=True)
