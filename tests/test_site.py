"""The documentation's generators: each technique, example and public name has its place, and links
that lead nowhere are found. The whole site is built by docs/site/build_site.py."""

import inspect
import re
import sys
from pathlib import Path

import pytest

import moit
from moit.catalog.papers import PAPERS

pytest.importorskip("matplotlib")
SITE = Path(__file__).parents[1] / "docs" / "site"
# Before what is found by it, so imports stand below a statement.
sys.path.insert(0, str(SITE))
import build_site  # noqa: E402
import links  # noqa: E402
import reference  # noqa: E402
import technique_pages  # noqa: E402

sys.path.remove(str(SITE))


def test_each_technique_has_an_idea_and_no_other_has():
    classes = technique_pages.classes()
    for one in classes:
        text = technique_pages.idea(one)
        assert len(text) < 2500 and "$$" in text, one
    assert {path.stem for path in technique_pages.IDEAS.glob("*.md")} == {
        one.__name__ for one in classes
    }


def test_an_idea_that_lacks_a_part_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(technique_pages, "IDEAS", tmp_path)
    with pytest.raises(ValueError, match=r"Sorted\.md: expected for"):
        technique_pages.idea(moit.Sorted)
    (tmp_path / "Sorted.md").write_text("All.\n\n## Equations\n\n$$x$$\n")
    with pytest.raises(ValueError, match="expected an idea, Equations, Where it fails"):
        technique_pages.idea(moit.Sorted)


@pytest.mark.parametrize("one", [moit.FourierOpacity, moit.WeightedSum, moit.Sorted])
def test_a_page_has_facts_curves_errors_and_sources(one, tmp_path, monkeypatch):
    monkeypatch.setattr(technique_pages, "SIZE", (40, 24))
    monkeypatch.setattr(technique_pages, "SCENES", ("spheres", "hair"))
    for name in ("scene", "exact"):
        getattr(technique_pages, name).cache_clear()
    text = technique_pages.page(one, tmp_path)
    for cached in (technique_pages.scene, technique_pages.exact):
        cached.cache_clear()
    variants = technique_pages.classes()[one]
    for title in ("What it stores", "Its curve beside the truth", "Where it fails", "Cost"):
        assert text.count(f"\n## {title}\n") == 1
    for variant in variants:
        bits = "grows with fragments" if variant.bits_per_pixel is None else variant.bits_per_pixel
        assert f"| `{variant}` | {bits} | {variant.geometry_passes} | {variant.access} |" in text
    errors = [float(value) for value in re.findall(r"\| `\w+` \| (0\.\d{4}) \|", text)]
    assert len(errors) == 2 and errors == sorted(errors, reverse=True)
    assert (max(errors) == 0) == (one is moit.Sorted)
    assert variants[0].cited and all(PAPERS[key].entry(key) in text for key in variants[0].cited)
    for picture in re.findall(r"\{image\} (\S+)", text):
        assert moit.read_image(tmp_path / picture).shape[0] >= 24


def test_all_that_is_public_has_one_place():
    placed = [name for names in reference.subjects().values() for name in names]
    assert sorted(placed) == sorted(moit.__all__)
    assert all(reference.SUBJECTS[title][0] for title in reference.subjects())


def test_docstrings_become_myst():
    text = """What it *is*.

    name : a `moit.composite` of a < b,
        and more.
    other, third : x_y.

    - one
      goes on
    - two

        T = exp(-x)

    >>> 1 + 1
    2
    """
    made = reference.myst(inspect.cleandoc(text), {"moit.composite"})
    assert made == "\n\n".join(
        [
            r"What it \*is\*.",
            "`name`\n: a {py:obj}`moit.composite` of a \\< b, and more.",
            "`other, third`\n: x\\_y.",
            "- one goes on\n- two",
            "```text\nT = exp(-x)\n```",
            "```pycon\n>>> 1 + 1\n2\n```",
        ]
    )


def test_examples_are_listed_and_have_a_title_and_a_text():
    found = sorted((SITE / "examples").glob("*.py"))
    assert sorted(build_site.ORDER) == [path.stem for path in found] and 12 <= len(found) <= 20
    for path in found:
        title, text, code = build_site.read_example(path)
        assert title[0].isupper() and not title.endswith(".") and text.endswith(".")
        assert '"picture.png"' in code
        compile(code, path.name, "exec")


def test_an_example_runs(tmp_path):
    said = build_site.run_example(SITE / "examples" / "own_fragments.py", tmp_path)
    assert said.startswith("Fragments(")
    assert moit.read_image(tmp_path / "own_fragments.png").shape[:2] == (120, 200)


def test_guides_and_notebooks_are_all_listed(tmp_path):
    build_site.copy_guides(tmp_path / "guides")
    build_site.copy_notebooks(tmp_path / "notebooks")
    for path in (tmp_path / "guides").glob("*.md"):
        for target in re.findall(r"\]\(([^)\s#]+)[^)]*\)", path.read_text(encoding="utf-8")):
            assert "://" in target or (path.parent / target).exists(), (path.name, target)


def test_links_of_a_guide_that_leave_the_site_are_paths():
    text = "[a](claims.md#x) [`b.c`](../csrc/b.c) [c](../notebooks/splats.ipynb) ![d](e.png)"
    assert build_site.relinked(text, {"claims.md"}) == (
        "[a](claims.md#x) `b.c` (`csrc/b.c`) [c](../notebooks/splats.ipynb) ![d](e.png)"
    )
    assert build_site.relinked("[claims.md](claims.md)", {"claims.md"}) == "[](claims.md)"


def test_links_that_lead_nowhere_are_named(tmp_path):
    (tmp_path / "a.html").write_text(
        '<a href="b.html#there">x</a><a href="b.html#gone">y</a><img src="no.png">'
        '<a href="#own" id="own">z</a><a href="https://example.org/none">w</a>'
    )
    (tmp_path / "b.html").write_text('<p id="there">text</p><a href="a.html">back</a>')
    assert links.broken(tmp_path) == ["a.html: b.html#gone", "a.html: no.png"]


ROOT = SITE.parents[1]
LINK = re.compile(r"\]\(([^)\s#]*)(?:#([^)\s]*))?\)")


def links_of(page):
    """(file, anchor) of what a page leads to within the repository."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    for target, anchor in LINK.findall(text):
        if "://" not in target:
            yield (page.parent / target).resolve() if target else page, anchor


def anchors_of(page):
    """As code hosts make them of headings."""
    heads = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", one.lower()).replace(" ", "-") for one in heads}


def test_readme_is_short_and_leads_to_all_guides_and_notebooks():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 200
    seen, ahead = set(), [ROOT / "README.md"]
    while ahead:
        page = ahead.pop()
        seen.add(page)
        if page.suffix == ".md":
            for target, anchor in links_of(page):
                assert target.exists(), (page.name, target)
                assert not anchor or anchor in anchors_of(target), (page.name, anchor)
                if target not in seen and target.suffix in (".md", ".ipynb"):
                    ahead.append(target)
    wanted = {
        ROOT / "docs" / f"{name}.md" for names in build_site.GUIDES.values() for name in names
    }
    wanted |= {ROOT / "notebooks" / f"{name}.ipynb" for name in build_site.NOTEBOOKS}
    assert wanted <= seen
