"""Prints what is told of a release where it is published: python docs/release_notes.py [VERSION]

The section of CHANGELOG.md, each point on one line, as pages of releases keep line breaks; how to
install it; how to cite it. Without a version it is the newest.
"""

import argparse
import re
import sys
from pathlib import Path

import moit

ROOT = Path(__file__).parents[1]


def sections(changelog: str) -> dict[str, str]:
    """Version -> its points, the newest first."""
    found = re.split(r"^## (\S+).*\n", changelog, flags=re.MULTILINE)[1:]
    return {version: text.strip() for version, text in zip(found[::2], found[1::2], strict=True)}


def unwrapped(text: str) -> str:
    """Points and paragraphs on one line each; what is indented within a point belongs to it."""
    return re.sub(r"\n(?!\n|- |#) *", " ", text)


def notes(changelog: str, version: str | None = None) -> str:
    """What is told of a version. ValueError where the changelog has no section of it."""
    known = sections(changelog)
    wanted = next(iter(known), "") if version is None else version
    if wanted not in known:
        raise ValueError(f"version: CHANGELOG.md has {', '.join(known) or 'none'}, not {wanted!r}")
    if not known[wanted]:
        raise ValueError(f"version: CHANGELOG.md says nothing of {wanted}")
    return "\n".join(
        [
            f"# moit {wanted}",
            "",
            unwrapped(known[wanted]),
            "",
            "## Install",
            "",
            f"    pip install 'moit[all]=={wanted}'",
            "",
            "## Cite",
            "",
            "`moit cite NAME` prints BibTeX of a technique's papers and of moit:",
            "",
            *(f"    {line}" for line in moit.cite().splitlines()),
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("version", nargs="?", help="default: the newest")
    options = parser.parse_args()
    try:
        print(notes((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), options.version))
    except ValueError as error:
        sys.exit(f"release_notes: {error}")


if __name__ == "__main__":
    main()
