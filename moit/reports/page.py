"""A page of HTML that needs nothing beside itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files


def html_page(
    title: str, about: str, links: Mapping[str, str], body: str, scripts: Sequence[str] = ()
) -> str:
    """The text of a page.

    about : a line under the title, plain text.
    links : what the bar under it leads to: plain texts by the id of their place in the page.
    body : HTML.
    scripts : names of our scripts beside "page.js", which every page has.
    """
    bar = "".join(f'<a href="#{escape(i)}">{escape(text)}</a>' for i, text in links.items())
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width,initial-scale=1">
<meta name="generator" content="moit">
<title>{escape(title)}</title>
<style>
{_own("page.css")}</style>
</head>
<body>
<h1>{escape(title)}</h1>
<p class="faint">{escape(about)}</p>
<nav>{bar}</nav>
{body}
<script>
{"".join(map(_own, ("page.js", *scripts)))}</script>
</body>
</html>
"""


def _own(name: str) -> str:
    return files("moit.reports").joinpath(name).read_text(encoding="utf-8")
