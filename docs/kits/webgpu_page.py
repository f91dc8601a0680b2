"""A kit in a page for browsers with WebGPU: the shaders and the table of wgpu_panes.py, drawn by
plain JavaScript.

    python docs/kits/webgpu_page.py panes.html
"""

from __future__ import annotations

import base64
import json
import sys
from pathlib import Path

from panes import BACKGROUND, HEIGHT, WIDTH, panes, vertices
from wgpu_panes import exported

from moit.system.files import write_text

SCRIPT = Path(__file__).with_suffix(".js")
PAGE = """<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<title>Panes of glass, by power6 of moit</title>
<canvas id="picture" width="{width}" height="{height}" style="width: 60em"></canvas>
<p id="said"></p>
<script>
const kit = {kit};
{script}</script>
</html>
"""


def page() -> str:
    """All of it: nothing is loaded from anywhere."""
    text, table = exported()
    data = vertices(panes())
    kit = {
        "shaders": text,
        "table": table,
        "vertices": base64.b64encode(data.tobytes()).decode(),
        "count": len(data),
        "background": [*BACKGROUND, 1.0],
    }
    inside = json.dumps(kit).replace("</", "<\\/")
    script = SCRIPT.read_text(encoding="utf-8")
    return PAGE.format(width=WIDTH, height=HEIGHT, kit=inside, script=script)


if __name__ == "__main__":
    write_text(sys.argv[1], page())
