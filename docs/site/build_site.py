"""Builds the documentation site: python docs/site/build_site.py [-o build/site]

Sources are put together in OUT/source (pages, guides, notebooks, and what is generated:
techniques, examples, reference), Sphinx makes OUT/html of them and takes warnings for errors, and
then every link within the site is looked at. `pip install '.[docs]'` brings what it needs.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

SITE = Path(__file__).resolve().parent
ROOT = SITE.parents[1]
# Before what is found by it, so imports stand below a statement.
sys.path[:0] = [str(ROOT), str(SITE)]

import links  # noqa: E402
import reference  # noqa: E402
import technique_pages  # noqa: E402

# Guides in the order of the contents; what each file is called stands in its first line.
GUIDES = {
    "Use": ("questions", "techniques", "drawing", "own_technique", "gpu"),
    "What is certain, and how exact": (
        "exactness",
        "accuracy",
        "claims",
        "performance",
        "frontier",
    ),
    "Pictures": ("splats", "primitives", "mixed-resolution", "blocks", "renormalised"),
    "Deep images, gradients, networks": ("deep", "gradients", "neural"),
    "GPUs": ("gpu_costs", "kits"),
    "The papers again": ("gallery",),
}
PARTS = {"frontier_tried"}  # of other pages, which hold their text
NOTEBOOKS = ("first_look", "transmittance", "speed_against_error", "stability", "own_technique")
NOTEBOOKS += ("splats", "fitting", "opacity", "deep_images", "neural", "moderngl")


def relinked(text: str, own: set[str]) -> str:
    """A guide whose links to files that the site does not have are code: their path in the
    repository. Notebooks are beside guides here."""

    def put(found: re.Match[str]) -> str:
        label, target = found[1], found[2]
        path, mark, anchor = target.partition("#")
        if "://" in target or not path:
            return found[0]
        if path.startswith("../notebooks/") and Path(path).stem in NOTEBOOKS:
            return f"[{label}](../notebooks/{Path(path).stem}.ipynb)"
        if path in own:  # a file's name gives way to what it is called
            return f"[{'' if label.strip('`') == path else label}]({path}{mark}{anchor})"
        named = os.path.normpath(Path("docs", path))
        return f"`{named}`" if label.strip("`") in (path, named) else f"{label} (`{named}`)"

    return re.sub(r"(?<!!)\[([^\]]*)\]\(([^)\s]+)\)", put, text)


def copy_guides(folder: Path) -> None:
    folder.mkdir(parents=True)
    docs = ROOT / "docs"
    listed = {name for names in GUIDES.values() for name in names}
    found = {path.stem for path in docs.glob("*.md")} - PARTS
    if listed != found:
        raise SystemExit(
            f"docs/site/build_site.py: GUIDES and docs/*.md differ: {sorted(listed ^ found)}"
        )
    own = {f"{name}.md" for name in listed} | {p.name for p in docs.glob("*.png")}
    own |= {str(p.relative_to(docs)) for p in (docs / "gallery").rglob("*") if p.is_file()}
    for name in listed:
        text = (docs / f"{name}.md").read_text(encoding="utf-8")
        (folder / f"{name}.md").write_text(relinked(text, own), encoding="utf-8")
    for picture in docs.glob("*.png"):
        shutil.copy(picture, folder)
    shutil.copytree(docs / "gallery", folder / "gallery")
    contents = ["# Guides and notebooks", ""]
    for title, names in GUIDES.items():
        contents += ["```{toctree}", f":caption: {title}", ":maxdepth: 1", "", *names, "```", ""]
    contents += ["```{toctree}", ":caption: Notebooks", ":maxdepth: 1", ""]
    contents += [*(f"../notebooks/{name}" for name in NOTEBOOKS), "```", ""]
    (folder / "index.md").write_text("\n".join(contents), encoding="utf-8")


def copy_notebooks(folder: Path) -> None:
    folder.mkdir(parents=True)
    found = {path.stem for path in (ROOT / "notebooks").glob("*.ipynb")}
    if set(NOTEBOOKS) != found:
        raise SystemExit(
            f"docs/site/build_site.py: NOTEBOOKS and notebooks/ differ: {found ^ set(NOTEBOOKS)}"
        )
    for name in NOTEBOOKS:
        shutil.copy(ROOT / "notebooks" / f"{name}.ipynb", folder)


def read_example(path: Path) -> tuple[str, str, str]:
    """(title, text, code) of an example: its docstring begins with a title and an empty line."""
    found = re.match(r'"""(.+)\n\n(.+?)\n"""\n\n(.*)', path.read_text(encoding="utf-8"), re.DOTALL)
    if not found:
        raise SystemExit(f"{path.name}: expected a docstring of a title, an empty line and a text")
    return found[1], found[2], found[3]


def run_example(path: Path, folder: Path) -> str:
    """Its picture into a folder; what it printed."""
    with tempfile.TemporaryDirectory() as work:
        paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        environment = os.environ | {"PYTHONPATH": paths, "MPLBACKEND": "Agg"}
        command = [sys.executable, "-W", "error", str(path)]
        done = subprocess.run(command, cwd=work, env=environment, capture_output=True, text=True)
        picture = Path(work, "picture.png")
        if done.returncode or not picture.exists():
            raise SystemExit(f"{path.name}: {done.stderr or 'wrote no picture.png'}")
        shutil.copy(picture, folder / f"{path.stem}.png")
    return done.stdout.strip()


def write_examples(folder: Path) -> None:
    folder.mkdir(parents=True)
    cards, names = [], []
    for path in sorted((SITE / "examples").glob("*.py"), key=lambda one: ORDER.index(one.stem)):
        title, text, code = read_example(path)
        said = run_example(path, folder)
        parts = [f"# {title}", text, f"```{{image}} {path.stem}.png\n:alt: {title}\n```"]
        parts.append(f"```python\n{code.strip()}\n```")
        parts += [f"```text\n{said}\n```"] if said else []
        (folder / f"{path.stem}.md").write_text("\n\n".join([*parts, ""]), encoding="utf-8")
        names.append(path.stem)
        cards.append(
            f":::{{grid-item-card}} {title}\n:link: {path.stem}\n:link-type: doc\n"
            f":img-top: {path.stem}.png\n:::"
        )
    contents = [
        "# Examples",
        "Each is a whole program; its picture is what it writes.",
        "\n".join(["::::{grid} 1 2 3 3", ":gutter: 3", "", *cards, "::::"]),
        "\n".join(["```{toctree}", ":hidden:", "", *names, "```", ""]),
    ]
    (folder / "index.md").write_text("\n\n".join(contents), encoding="utf-8")


ORDER = (
    *("first_picture", "own_fragments", "curves", "bounds", "compare", "bits_against_error"),
    *("per_pixel", "own_technique", "glass", "splats", "streamlines", "volume", "shadows"),
    *("deep_images", "gradients", "stability"),
)


def build(out: Path) -> None:
    source, html = out / "source", out / "html"
    for folder in (source, html):
        shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(SITE / "pages", source)
    shutil.copy(SITE / "conf.py", source)
    shutil.copytree(SITE / "_static", source / "_static")
    copy_guides(source / "guides")
    copy_notebooks(source / "notebooks")
    write_examples(source / "examples")
    technique_pages.write_pages(source / "techniques")
    reference.write_pages(source / "reference")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    subprocess.run([*command, "-d", out / "doctrees", source, html], check=True, env=with_root())
    broken = links.broken(html)
    if broken:
        raise SystemExit("\n".join(["links that lead nowhere:", *broken]))


def with_root() -> dict[str, str]:
    return os.environ | {
        "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "build" / "site")
    options = parser.parse_args()
    build(options.output.resolve())
    print(options.output / "html" / "index.html")


if __name__ == "__main__":
    main()
