"""Papers: each technique's in BibTeX, and CITATION.cff beside them."""

import re
from pathlib import Path

import pytest

import moit
from moit.__main__ import main
from moit.catalog.papers import OWN_TITLE, PAPERS
from moit.catalog.technique import Technique

ROOT = Path(__file__).parents[1]
ENTRY = re.compile(r"@(\w+)\{(\w+),\n((?:  \w+ = \{.*\},\n)+)\}")


def entries(text):
    """Key -> fields of each entry; nothing else may stand between them."""
    assert ENTRY.sub("", text).strip() == ""
    return {
        found[2]: dict(re.findall(r"^  (\w+) = \{(.*)\},$", found[3], re.MULTILINE))
        for found in ENTRY.finditer(text)
    }


def kinds():
    """Every class of techniques that has a source."""
    found, left = [], [Technique]
    while left:
        one = left.pop()
        left += one.__subclasses__()
        if "source" in vars(one) and one is not Technique:
            found.append(one)
    return found


@pytest.mark.parametrize("one", moit.techniques(), ids=str)
def test_a_technique_has_the_papers_that_its_source_names(one):
    cited = entries(moit.cite(one))
    assert list(cited)[-1] == "moit"
    papers = {key: fields for key, fields in cited.items() if key != "moit"}
    assert papers or one.source.startswith("ours") or one.source.startswith("one's own")
    for name, year in re.findall(
        r"([A-Z]\w+)(?: et al\.| and \w+|, \w+ and \w+)? (\d{4})", one.source
    ):
        plain = name.replace("ue", "u")
        assert any(
            fields["year"] == year and plain in re.sub(r"[{}\\\"]", "", fields["author"])
            for fields in papers.values()
        ), (name, year)


def test_every_paper_is_somebodys():
    used = {key for one in kinds() for key in one.papers}
    assert len(used) > 15
    options = {"mcguire2017": "wboit-phenomenological", "mueller2025": "trig3(intervals=5)"}
    for key, name in options.items():
        assert key in entries(moit.cite(name))
        assert key not in entries(moit.cite("wboit", "trig3"))
    assert used | set(options) | {"hou2025"} == set(PAPERS)
    assert "hou2025" in entries(moit.cite(moit.SortFree()))


def test_entries_are_what_bibtex_reads():
    text = moit.cite(*moit.techniques())
    assert text.isascii()
    for key, fields in entries(text).items():
        for value in fields.values():
            depth = 0
            for letter in value:
                depth += (letter == "{") - (letter == "}")
                assert depth >= 0, key
            assert depth == 0, key
        assert key == "moit" or re.fullmatch(r"[a-z]+" + fields["year"] + "[a-z]*", key)
        for author in fields["author"].split(" and "):
            assert key == "moit" or author.count(", ") == 1, author  # family, given


def test_several_have_each_paper_once_the_oldest_first():
    cited = entries(moit.cite("power4", "sorted", "trig3", "power4(bias=0.0)"))
    assert list(cited) == ["carpenter1984", "muenstermann2018", "moit"]
    cited = entries(moit.cite("kbuffer4", "depth-peeling4"))
    assert list(cited) == ["everitt2001", "bavoil2007", "moit"]
    assert list(entries(moit.cite())) == ["moit"]
    assert [p.year for p in PAPERS.values()] == sorted(p.year for p in PAPERS.values())
    with pytest.raises(ValueError, match="did you mean"):
        moit.cite("pover4")


def test_the_shell_cites_too(capsys):
    assert main(["cite", "power4,wboit"]) == 0
    assert capsys.readouterr().out.strip() == moit.cite("power4", "wboit")
    assert main(["cite"]) == 0
    assert capsys.readouterr().out.strip() == moit.cite()
    assert main(["cite", "nobody"]) == 1
    assert "there is no 'nobody'" in capsys.readouterr().err


def test_the_citation_file_is_of_this_version_and_these_papers():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert text.count(f'title: "{OWN_TITLE}"') == 2  # the software, and how it is preferably cited
    assert set(re.findall(r"^ *version: (.+)$", text, re.MULTILINE)) == {moit.__version__}
    dois = re.findall(r"doi: (.+)$", text, re.MULTILINE)
    known = {dict(paper.details).get("doi") for paper in PAPERS.values()}
    assert dois and set(dois) <= known
