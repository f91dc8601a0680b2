"""A kit in a program of moderngl: power4 by two passes and a resolve, against moit's own picture.

python docs/kits/moderngl_panes.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import moderngl
import numpy as np
from panes import BACKGROUND, FAR, HEIGHT, NEAR, WIDTH, panes, reference, vertices

import moit

VERTEX = """#version 450
in vec2 place;
in float pane_depth, pane_alpha;
in vec3 pane_color;
out float depth, alpha;
out vec3 color;
void main() {
    depth = pane_depth;
    alpha = pane_alpha;
    color = pane_color;
    gl_Position = vec4(place, 0.0, 1.0);
}
"""
WHOLE = """#version 450
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
"""
# Where fma may round twice, exact products are split: right everywhere, and a little dearer.
HEAD = "#version 450\n#define MOIT_NOT_FUSED 1\n"
GIVEN = "in float depth, alpha;\nin vec3 color;\n"
PASS_1 = """
layout(location = 0) out vec4 target0;
layout(location = 1) out float target1;
void main() {
    moit_sums sums = moit_accumulate(moit_warped(depth), alpha);
    target0 = sums.target0;
    target1 = sums.target1;
}
"""
PASS_2 = """
layout(location = 0) out vec4 target2;
void main() {
    moit_factors pixel = moit_factor(moit_fetched(ivec2(gl_FragCoord.xy)));
    float through = moit_transmittance(pixel, moit_warped(depth), alpha);
    target2 = moit_shaded(color, alpha, through);
}
"""
RESOLVE = """
layout(location = 0) out vec4 picture;
void main() { picture = moit_resolved(ivec2(gl_FragCoord.xy)); }
"""


def draw(found: np.ndarray, include: str) -> np.ndarray:
    """(HEIGHT, WIDTH, 3), linear."""
    libraries = {"libegl": "libEGL.so.1", "libgl": "libEGL.so.1"}  # no display is needed
    context = moderngl.create_context(standalone=True, backend="egl", require=450, **libraries)
    size = (WIDTH, HEIGHT)
    # formats, clear values and blend functions are those of targets.json
    moments = context.texture(size, 4, dtype="f4")
    total = context.texture(size, 1, dtype="f4")
    colours = context.texture(size, 4, dtype="f2")
    picture = context.texture(size, 4, dtype="f4")
    captured = context.framebuffer([moments, total])
    shaded = context.framebuffer([colours])
    final = context.framebuffer([picture])

    geometry = context.buffer(vertices(found).tobytes())
    names = ("place", "pane_depth", "pane_alpha", "pane_color")

    def drawn(fragment: str) -> moderngl.VertexArray:
        program = context.program(VERTEX, fragment)
        used = [name for name in names if name in program]
        sizes = {"place": "2f", "pane_depth": "1f", "pane_alpha": "1f", "pane_color": "3f"}
        layout = [sizes[one] if one in used else f"{4 * int(sizes[one][0])}x" for one in names]
        return context.vertex_array(program, [(geometry, " ".join(layout), *used)])

    first = drawn(f"{HEAD}#define MOIT_NO_FETCH\n{include}{GIVEN}{PASS_1}")
    second = drawn(HEAD + include + GIVEN + PASS_2)
    whole = context.vertex_array(context.program(WHOLE, HEAD + include + RESOLVE), [])

    context.enable(moderngl.BLEND)
    context.blend_func = moderngl.ONE, moderngl.ONE
    captured.clear()
    captured.use()
    first.render()
    for binding, texture in enumerate((moments, total, colours)):
        texture.use(binding)
    shaded.clear()
    shaded.use()
    second.render()
    context.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
    final.clear(*BACKGROUND, 1.0)
    final.use()
    whole.render(moderngl.TRIANGLES, vertices=3)
    rows = np.frombuffer(picture.read(), np.float32).reshape(HEIGHT, WIDTH, 4)
    context.release()
    return rows[::-1, :, :3]  # OpenGL's first row is the lowest


def main() -> float:
    """The largest difference from moit's picture."""
    with tempfile.TemporaryDirectory() as folder:
        moit.export("power4", folder, "glsl", depth_range=(NEAR, FAR))
        include = Path(folder, "moit_power4.glsl").read_text()
    found = panes()
    difference = np.abs(draw(found, include) - reference("power4(bias='published')", found)).max()
    print(f"power4 in GLSL by moderngl: off from moit's picture by at most {difference:.1e}")
    return float(difference)


if __name__ == "__main__":
    main()
