"""Links within a folder of HTML: python docs/site/links.py FOLDER names those that lead nowhere."""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """What a page leads to, and the names of places in it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.places: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src") and value and tag != "base":
                self.targets.append(value)
            elif name == "id" or (name == "name" and tag == "a"):
                self.places.add(value or "")


def broken(folder: Path) -> list[str]:
    """`page: target` of each link and picture that is not there; other sites are not asked."""
    files = [path for path in folder.rglob("*.html") if "_static" not in path.parts]  # themes'
    pages = {path.resolve(): Page(path.read_text(encoding="utf-8")) for path in files}
    found = []
    for path, page in pages.items():
        for target in page.targets:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            there = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            place = unquote(parts.fragment)
            missing = not there.is_file() or (
                there in pages and place not in {"", "top"} and place not in pages[there].places
            )
            if missing:
                found.append(f"{path.relative_to(folder.resolve())}: {target}")
    return sorted(set(found))


if __name__ == "__main__":
    told = broken(Path(sys.argv[1]))
    print("\n".join(told) or "all links lead somewhere")
    sys.exit(bool(told))
