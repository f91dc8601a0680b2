"""What a report's page opens with: the answer, and the reference's picture beside three others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

from moit.catalog.palette import Look
from moit.comparing.answer import Answer, Name
from moit.comparing.error_maps import map_range, scale
from moit.comparing.page_pictures import Pictures, Shown, told_numbers
from moit.comparing.rows import Findings, Scene
from moit.reports.charts import on_page
from moit.reports.columns import plain_number
from moit.reports.pictures import data_uri, map_png

METRICS_EXPLAINED = {
    "flip": "FLIP: how different pictures look, from 0 (the same) to 1.",
    "T_mae": "Transmittance: the share of light that reaches a fragment, from 0 to 1.",
}


def opening(
    found: Findings,
    said: Answer,
    pictures: Pictures | None,
    palette: Mapping[str, Look],
    width: int,
) -> str:
    """HTML. pictures : of the answer's scene. width : of the widest."""
    sentences = " ".join("".join(_words(sentence)) for sentence in said.sentences[:1])
    rest = " ".join("".join(_words(sentence)) for sentence in said.sentences[1:])
    explained = METRICS_EXPLAINED.get(found.main_metric(), "")
    second = " ".join(part for part in (rest, f'<span class="faint">{escape(explained)}</span>'))
    return (
        f'<section class="opening"><p class="answer">{sentences}</p><p>{second}</p>'
        f"{_strip(found, said, pictures, palette, width)}</section>"
    )


def _words(sentence: Iterable[str]) -> list[str]:
    return [f"<strong>{escape(w)}</strong>" if isinstance(w, Name) else escape(w) for w in sentence]


def _strip(
    found: Findings,
    said: Answer,
    pictures: Pictures | None,
    palette: Mapping[str, Look],
    width: int,
) -> str:
    if pictures is None:
        return ""
    by_name: dict[str, Shown] = {}
    for one in pictures.shown:
        by_name.setdefault(one.result.row["technique"], one)
    chosen = [by_name[name] for name in said.shown if name in by_name]
    metric = found.main_metric()
    # Of these three alone: what they differ by is seen.
    maps = [one.errors for one in chosen]
    most = map_range(maps) if maps else 1.0
    scaled = f"Below each picture its {scale(most, pictures.what, maps)}" if maps else ""
    figures = [_reference(found, pictures, scaled)]
    for one in chosen:
        row = one.result.row
        errors = data_uri(map_png(one.errors / most, width))
        colour = on_page(palette[row["technique"]].colour)
        figures.append(
            f'<figure><img src="{one.image}" alt="{escape(row["technique"])}">'
            f'<img src="{errors}" alt="its errors">'
            f'<figcaption><span class="dot" style="background:{colour}"></span>'
            f"<strong>{escape(row['technique'])}</strong> "
            f'<span class="faint">{escape(told_numbers(row, metric))}</span></figcaption></figure>'
        )
    return f'<div class="strip">{"".join(figures)}</div>'


def _reference(found: Findings, pictures: Pictures, scaled: str) -> str:
    return (
        f'<figure><img src="{pictures.reference}" alt="reference">'
        f'<div class="about faint"><p>{facts(pictures.scene)}</p><p>'
        f"{scaled}</p></div><figcaption><strong>reference</strong> "
        f'<span class="faint">{escape(found.reference)}, on {escape(pictures.scene.name)}</span>'
        "</figcaption></figure>"
    )


def facts(scene: Scene) -> str:
    """A scene's size."""
    mean = scene.fragments / max(scene.shape[0] * scene.shape[1], 1)
    return (
        f"{scene.shape[1]} x {scene.shape[0]} pixels, {scene.fragments:,} fragments: "
        f"{plain_number(mean, 2)} a pixel, at most {scene.most_layers:,}"
    )
