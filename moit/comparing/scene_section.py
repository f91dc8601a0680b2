"""A scene's part of a report's page: pictures with error maps, curves, error against cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from moit.catalog.palette import INK, Look, family_title
from moit.comparing.answer import nearness
from moit.comparing.charts import errors_chart, scene_curves
from moit.comparing.opening import facts
from moit.comparing.page_pictures import Pictures, Shown, labelled, told_numbers
from moit.comparing.rows import Findings, Result, Scene
from moit.comparing.tables import PAPER_HEADS
from moit.reports.legend import Entry, legend
from moit.reports.svg import svg

FIRST_CARDS = 6  # beside the large picture; the others are a click away
MOST_CURVES = 6  # at once: as many as one can tell apart


def scene_section(
    found: Findings,
    name: str,
    place: str,
    pictures: Pictures | None,
    keys: Mapping[int, str],
    palette: Mapping[str, Look],
    first: Sequence[str],
) -> str:
    """HTML. place : its id. keys : of rows. first : techniques whose curves are shown first."""
    scene = found.scenes.get(name)
    results = found.of_scene(name)
    head = f'<h2 id="{place}">{escape(name)}</h2>'
    if scene is not None:
        head += f'<p class="faint">{facts(scene)}</p>'
    metric = found.main_metric()
    parts = [head]
    if pictures is not None:
        parts.append(_pictures(pictures, metric))
    if scene is not None:
        parts.append(_curves(scene, _in_order(found, results, first), keys, palette))
    parts.append(_fronts(found, results, keys, palette))
    return f'<section class="of-scene">{"".join(parts)}</section>'


# Pictures


def _pictures(pictures: Pictures, metric: str) -> str:
    cards = [_card(one, metric, i == 0) for i, one in enumerate(pictures.shown)]
    more = ""
    if len(cards) > FIRST_CARDS:
        more = (
            f"<details><summary>{len(cards) - FIRST_CARDS} more pictures</summary>"
            f'<div class="gallery">{"".join(cards[FIRST_CARDS:])}</div></details>'
        )
    return (
        f'<div class="scene"><div>{_view(pictures)}</div><div class="gallery">'
        f"{''.join(cards[:FIRST_CARDS])}</div></div>"
        f'<p class="faint">Nearest first, each beside its {pictures.scale}</p>{more}'
    )


def _view(pictures: Pictures) -> str:
    height, across = pictures.scene.shape
    smooth = " smooth" if across >= 400 else ""
    modes = (
        ("technique", "Technique"),
        ("reference", "Reference"),
        ("map", "Error map"),
        ("split", "Split"),
        ("flicker", "Flicker"),
    )
    buttons = "".join(f'<button data-mode="{m}">{text}</button>' for m, text in modes)
    # A ray or a strip would be a line or a tower.
    ratio = min(max(across / height, 1.0), 4.0)
    return (
        f'<div class="view" style="aspect-ratio:{ratio:.4f}">'
        f'<img class="reference{smooth}" src="{pictures.reference}" alt="reference">'
        f'<img class="front{smooth}" alt="" hidden>'
        '<div class="seam" hidden></div><span class="tag">reference</span>'
        '<span class="tag right" hidden></span></div>'
        f'<div class="controls">{buttons}</div>'
        '<p class="faint controls">Choose a technique beside it, below or in a plot; click the '
        "picture to change to the reference and back.</p>"
    )


def _card(one: Shown, metric: str, is_first: bool) -> str:
    name = escape(one.name)
    return (
        f'<div class="card" data-key="{one.key}" data-name="{name}"'
        f"{' data-first' if is_first else ''}>"
        f'<div class="pair"><img src="{one.image}" alt="{name}" loading="lazy">'
        f'<img src="{one.error}" alt="error of {name}" loading="lazy"></div>'
        f'<div class="name">{name}</div>'
        f'<div class="numbers faint">{escape(told_numbers(one.result.row, metric))}</div></div>'
    )


# Curves


def _in_order(found: Findings, results: Sequence[Result], first: Sequence[str]) -> list[Result]:
    """Those of the answer, then the nearest."""
    metric = found.main_metric()
    return sorted(
        results,
        key=lambda r: (r.row["technique"] not in first, nearness(r.row, metric)),
    )


def _curves(
    scene: Scene, results: Sequence[Result], keys: Mapping[int, str], palette: Mapping[str, Look]
) -> str:
    """A chart for each of the scene's pixels; curves beyond the first appear when chosen."""
    charts = scene_curves(scene, results, palette, keys)
    if not charts or not charts[0].series:
        return ""
    names = {keys[id(r.row)]: labelled(r.row) for r in results}
    entries = [Entry(names[one.key], one.colour, one.line, one.key) for one in charts[0].series]
    drawn = "".join(
        f"<figure><figcaption>Transmittance at x {x}, y {y}</figcaption>"
        f"{svg(chart, (370, 220), most=MOST_CURVES)}</figure>"
        for (y, x), chart in zip(scene.pixels, charts, strict=True)
    )
    more = ""
    if len(entries) > MOST_CURVES:
        more = (
            f"<details class='controls'><summary>{len(entries) - MOST_CURVES} more curves, each "
            f"shown where its name is clicked</summary>{legend(entries[MOST_CURVES:])}</details>"
        )
    return (
        f'<h3>Transmittance over depth</h3><div class="plots three">{drawn}</div>'
        f"{legend([Entry('exact', INK), *entries[:MOST_CURVES]])}{more}"
    )


# Error against cost


def _fronts(
    found: Findings, results: Sequence[Result], keys: Mapping[int, str], palette: Mapping[str, Look]
) -> str:
    metric = found.main_metric()
    words = PAPER_HEADS.get(metric, metric)
    rows = [result.row for result in results]
    colours = {name: look.colour for name, look in palette.items()}
    parts = []
    costs = [("bits", 1.0, "bits per pixel"), ("seconds", 1e3, "milliseconds")]
    if found.gpu:
        costs.append(("gpu", 1.0, f"milliseconds predicted on a {found.gpu}"))
    for by, factor, cost in costs:
        chart = errors_chart(found, rows, metric, by, colours, keys, factor, cost)
        if chart.points:
            parts.append(
                f"<figure><figcaption>{escape(words)} against {cost}</figcaption>"
                f"{svg(chart, (520, 320))}</figure>"
            )
    if not parts:
        return ""
    families: dict[str, Entry] = {}
    for name in dict.fromkeys(row["technique"] for row in rows):
        title = family_title(name)
        families.setdefault(title, Entry(title, palette[name].colour))
    return (
        f'<h3>Error against cost</h3><div class="plots two">{"".join(parts)}</div>'
        f"{legend(list(families.values()))}"
        '<p class="faint">The dashed line joins those that nothing beats in both; hollow marks '
        "are beaten. Ideas differ in hue, their members in lightness. Point at a mark for its name "
        "and numbers.</p>"
    )
