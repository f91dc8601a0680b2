"""A page for each class of techniques: what the catalog knows of it, its curve beside the truth,
and where it fails, on scenes that are the same for all."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import moit
from moit.catalog.papers import PAPERS
from moit.catalog.technique import EXACT
from moit.gpu_costs.cards import CARDS
from moit.gpu_costs.frames import Frame, predicted
from moit.gpu_costs.stored import ENGINE, stored

IDEAS = Path(__file__).parent / "ideas"

SIZE = (192, 108)
SCENES = ("spheres", "mixed", "hair", "smoke", "foliage", "teapots", "strands", "pond")
BEHIND = (0.2, 0.25, 0.35)
RAYS = {"a few surfaces": (3, 0.3, 0.9), "many faint ones": (40, 0.03, 0.15)}
CARD, FRAGMENTS, PIXELS = "rx6800", 8, 1920 * 1080


def classes() -> dict[type[moit.Technique], list[moit.Technique]]:
    """The catalog's techniques by their class, in its order."""
    found: dict[type[moit.Technique], list[moit.Technique]] = {}
    for one in moit.techniques():
        found.setdefault(type(one), []).append(one)
    return found


def idea(one: type[moit.Technique]) -> str:
    """What was written of it by hand. ValueError where that is missing, or lacks a part."""
    path = IDEAS / f"{one.__name__}.md"
    if not path.exists():
        raise ValueError(f"docs/site/ideas/{path.name}: expected for a technique of the catalog")
    text = path.read_text(encoding="utf-8")
    parts = [line for line in text.splitlines() if line.startswith("## ")]
    if parts != ["## Equations", "## Where it fails"] or text.startswith("#"):
        raise ValueError(
            f"docs/site/ideas/{path.name}: expected an idea, Equations, Where it fails"
        )
    return text


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def image(name: str, said: str, style: str = "") -> str:
    return f"```{{image}} {name}\n:alt: {said}\n{f':class: {style}' if style else ''}\n```"


def facts(variants: list[moit.Technique]) -> str:
    """What a pixel keeps of each, and what is so of all."""
    rows = []
    for one in variants:
        bits = "grows with fragments" if one.bits_per_pixel is None else f"{one.bits_per_pixel:g}"
        passes = "varies" if one.geometry_passes is None else str(one.geometry_passes)
        targets = ", ".join(f"{t.format} ({t.blend})" for t in one.targets) or "lists of fragments"
        rows.append([f"`{one}`", bits, passes, one.access, targets])
    one = variants[0]
    order = "any" + (", but of equal depths the earlier is in front" if one.ties_in_order else "")
    said = [
        ("Order of arrival", order if one.order_independent else "counts"),
        (
            "Fragments of one depth",
            {"together": "are one layer"}.get(one.ties, one.ties + " is in front"),
        ),
        ("A curve at every depth", yes(one.has_curve)),
        ("Coloured transmission", yes(one.supports_transmission)),
        ("Volumes and Gaussians", one.thick),
        ("Gradients", yes(one.has_gradient)),
        ("Exact pictures", exactness(one)),
    ]
    return "\n\n".join(
        [
            table(["name", "bits a pixel", "passes over geometry", "access", "targets"], rows),
            table(["question", "answer"], [[name, text] for name, text in said]),
        ]
    )


def exactness(one: moit.Technique) -> str:
    if one.exact_up_to == EXACT:
        return "always"
    return f"of up to {one.exact_up_to} fragments a pixel" if one.exact_up_to else "not promised"


def title_of(one: type[moit.Technique]) -> str:
    """`PowerMoments` -> Power moments."""
    words = re.findall(r"[A-Z](?:[a-z]+|(?=[A-Z]))", one.__name__)
    return " ".join(words).capitalize()


def yes(value: bool) -> str:
    return "yes" if value else "no"


def costs(variants: list[moit.Technique]) -> str:
    """Predicted milliseconds of a frame on a named card, of what has a kept cost."""
    rows, card = [], CARDS[CARD]
    frame = Frame(FRAGMENTS * PIXELS, PIXELS)
    for one in variants:
        passes = stored().passes(str(one), card.family, ENGINE)
        if passes is not None:
            rows.append([f"`{one}`", f"{predicted(one, passes, card, frame).total:.2f}"])
    if not rows:
        return "No frame is predicted for it: it has no kit (`moit export`) whose cost is known."
    said = (
        f"What a frame of 1920 x 1080 with {FRAGMENTS} transparent fragments a pixel is predicted "
        f"to take on a {card.title} ([how](../guides/gpu_costs.md); `moit recommend --by gpu` asks "
        "for your scene):"
    )
    return f"{said}\n\n{table(['name', 'milliseconds'], rows)}"


@cache
def scene(name: str) -> moit.Fragments:
    return moit.scenes.load(name, SIZE)


@cache
def exact(name: str) -> Any:
    return moit.composite(scene(name), "sorted", background=BEHIND)


def errors(one: moit.Technique) -> dict[str, tuple[float, Any]]:
    """Scene -> FLIP and the picture, the worst first."""
    found = {}
    for name in SCENES:
        picture = moit.composite(scene(name), one, background=BEHIND)
        found[name] = (float(moit.metrics.flip(picture, exact(name))), picture)
    return dict(sorted(found.items(), key=lambda item: -item[1][0]))


def failing(one: moit.Technique, found: dict[str, tuple[float, Any]], path: Path) -> str:
    """The scene that it does worst: exact, its picture, FLIP's map."""
    name, (error, picture) = next(iter(found.items()))
    shown = np.clip(
        moit.metrics.flip_map(picture, exact(name)) if error else np.zeros(SIZE[::-1]), 0, 1
    )
    panels = [exact(name)[..., :3], picture[..., :3], np.repeat(np.asarray(shown)[..., None], 3, 2)]
    gap = np.ones((SIZE[1], 4, 3))
    moit.write_image(path, np.concatenate([panels[0], gap, panels[1], gap, panels[2]], 1))
    rows = [[f"`{scene_name}`", f"{value:.4f}"] for scene_name, (value, _) in found.items()]
    return "\n\n".join(
        [
            f"`{one}` on `{name}`, of these scenes the one that it does worst: the exact picture, "
            "its own, and FLIP's map of the difference (white is most).",
            image(path.name, f"{name}: exact, {one}, difference", "pixels"),
            table(["scene", "FLIP"], rows),
        ]
    )


def ray(count: int, least: float, most: float) -> moit.Fragments:
    rng = np.random.default_rng(7)
    depth = np.sort(rng.uniform(1, 10, count))
    return moit.Fragments(
        [0, count], depth, rng.uniform(least, most, count), rng.random((count, 3))
    )


def curves(variants: list[moit.Technique], path: Path) -> str:
    """Along two rays, beside the exact one."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 3.4), layout="constrained")
    for ax, (title, numbers) in zip(axes, RAYS.items(), strict=True):
        f = ray(*numbers)
        moit.plot.curves(
            f, variants[:4] if variants[0].has_curve else "sorted", pixel=(0, 0), ax=ax
        )
        if not variants[0].has_curve:
            for one, mark in zip(variants[:4], "o^sv", strict=False):
                ax.plot(f.depth, moit.transmittance(f, one), mark, ms=5, label=str(one))
            ax.legend()
        ax.set_title(title)
    figure.savefig(path, dpi=110)
    plt.close(figure)
    kind = (
        "curve" if variants[0].has_curve else "transmittance at each fragment, as there is no curve"
    )
    return (
        f"Its {kind}, beside the exact one, along a ray with three surfaces and one with forty.\n\n"
        + image(path.name, "transmittance along two rays")
    )


def sources(variants: list[moit.Technique]) -> str:
    keys = {key for one in variants for key in one.cited}
    entries = [paper.entry(key) for key, paper in PAPERS.items() if key in keys]
    one = variants[0]
    text = f"{one.source}. `moit.cite({str(one)!r})`, `moit cite {one}`."
    return text + ("\n\n```bibtex\n" + "\n\n".join(entries) + "\n```" if entries else "")


def page(one: type[moit.Technique], folder: Path) -> str:
    """Its page as MyST; pictures are written to the folder."""
    variants = classes()[one]
    said, _, why = idea(one).partition("## Where it fails\n")
    return "\n\n".join(
        [
            f"# {title_of(one)}\n\n`{variants[0]}`"
            + (f" and {len(variants) - 1} more by name" if variants[1:] else ""),
            said.strip(),
            "## What it stores",
            facts(variants),
            "## Its curve beside the truth",
            curves(variants, folder / f"{one.__name__}_curves.png"),
            "## Where it fails",
            why.strip(),
            failing(variants[0], errors(variants[0]), folder / f"{one.__name__}_fails.png"),
            "## Cost",
            costs(variants),
            "## Options",
            f"{{py:class}}`moit.{one.__name__}` says what each option is.",
            "## Sources",
            sources(variants),
            "",
        ]
    )


def write_pages(folder: Path, only: tuple[str, ...] = ()) -> None:
    """All pages and a table of contents into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    rows, names = [], []
    for one, variants in classes().items():
        if only and one.__name__ not in only:
            continue
        (folder / f"{one.__name__}.md").write_text(page(one, folder), encoding="utf-8")
        names.append(one.__name__)
        first = variants[0]
        bits = "grows" if first.bits_per_pixel is None else f"{first.bits_per_pixel:g}"
        shown = ", ".join(f"`{v}`" for v in variants[:3]) + (", .." if variants[3:] else "")
        order = yes(first.order_independent)
        rows.append([f"[{title_of(one)}]({one.__name__}.md)", shown, bits, order, first.source])
    text = "\n".join(
        [
            "# Techniques",
            "",
            "A page each: its idea, what it stores, its equations, its curve beside the truth, "
            "where it fails, what it costs, and where it was published. "
            "[Which one should I take?](../which_one.md)",
            "",
            table(["technique", "names", "bits a pixel", "any order", "source"], rows),
            "",
            "```{toctree}\n:hidden:\n",
            *names,
            "```",
            "",
        ]
    )
    (folder / "index.md").write_text(text, encoding="utf-8")
