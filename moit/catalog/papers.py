"""The papers that techniques are from, as BibTeX has them."""

from __future__ import annotations

import dataclasses

from moit.catalog.names import technique
from moit.catalog.technique import Technique
from moit.system.version import VERSION


@dataclasses.dataclass(frozen=True)
class Paper:
    """An entry of BibTeX.

    kind : "article", "inproceedings", "misc", "software".
    authors, title, venue : in LaTeX's letters, capitals that stay in braces. What the venue is
        called depends on the kind: journal, booktitle or howpublished.
    details : further fields, as (name, value).
    """

    kind: str
    authors: str
    title: str
    venue: str
    year: int
    details: tuple[tuple[str, str], ...] = ()

    def entry(self, key: str) -> str:
        """Its text under this key."""
        place = {"article": "journal", "inproceedings": "booktitle"}.get(self.kind, "howpublished")
        fields = [
            ("author", self.authors),
            ("title", self.title),
            (place, self.venue),
            ("year", str(self.year)),
            *self.details,
        ]
        lines = [f"  {name} = {{{value}}}," for name, value in fields if value]
        return "\n".join([f"@{self.kind}{{{key},", *lines, "}"])


_I3D = "Proceedings of the {ACM} {SIGGRAPH} Symposium on Interactive {3D} Graphics and Games"
_SIGGRAPH_1984 = "Computer Graphics (Proceedings of {SIGGRAPH} 84)"
_TVCG = "{IEEE} Transactions on Visualization and Computer Graphics"

PAPERS = {
    "carpenter1984": Paper(
        "article",
        "Carpenter, Loren",
        "The {A}-buffer, an Antialiased Hidden Surface Method",
        _SIGGRAPH_1984,
        1984,
        (
            ("volume", "18"),
            ("number", "3"),
            ("pages", "103--108"),
            ("doi", "10.1145/800031.808585"),
        ),
    ),
    "porter1984": Paper(
        "article",
        "Porter, Thomas and Duff, Tom",
        "Compositing Digital Images",
        _SIGGRAPH_1984,
        1984,
        (
            ("volume", "18"),
            ("number", "3"),
            ("pages", "253--259"),
            ("doi", "10.1145/800031.808606"),
        ),
    ),
    "lokovic2000": Paper(
        "inproceedings",
        "Lokovic, Tom and Veach, Eric",
        "Deep Shadow Maps",
        "Proceedings of {SIGGRAPH} 2000",
        2000,
        (("pages", "385--392"), ("doi", "10.1145/344779.344958")),
    ),
    "everitt2001": Paper(
        "misc",
        "Everitt, Cass",
        "Interactive Order-Independent Transparency",
        "{NVIDIA} white paper",
        2001,
    ),
    "bavoil2007": Paper(
        "inproceedings",
        "Bavoil, Louis and Callahan, Steven P. and Lefohn, Aaron and Comba, Jo{\\~a}o L. D. and "
        "Silva, Cl{\\'a}udio T.",
        "Multi-fragment Effects on the {GPU} Using the {K}-buffer",
        _I3D,
        2007,
        (("pages", "97--104"), ("doi", "10.1145/1230100.1230117")),
    ),
    "meshkin2007": Paper(
        "misc",
        "Meshkin, Houman",
        "Sort-Independent Alpha Blending",
        "Game Developers Conference",
        2007,
    ),
    "bavoil2008": Paper(
        "misc",
        "Bavoil, Louis and Myers, Kevin",
        "Order Independent Transparency with Dual Depth Peeling",
        "{NVIDIA} white paper",
        2008,
    ),
    "jansen2010": Paper(
        "inproceedings",
        "Jansen, Jon and Bavoil, Louis",
        "Fourier Opacity Mapping",
        _I3D,
        2010,
        (("pages", "165--172"), ("doi", "10.1145/1730804.1730831")),
    ),
    "delalandre2011": Paper(
        "inproceedings",
        "Delalandre, Cyril and Gautron, Pascal and Marvie, Jean-Eudes and Fran{\\c{c}}ois, "
        "Guillaume",
        "Transmittance Function Mapping",
        _I3D,
        2011,
        (("pages", "31--38"), ("doi", "10.1145/1944745.1944751")),
    ),
    "enderton2011": Paper(
        "article",
        "Enderton, Eric and Sintorn, Erik and Shirley, Peter and Luebke, David",
        "Stochastic Transparency",
        _TVCG,
        2011,
        (
            ("volume", "17"),
            ("number", "8"),
            ("pages", "1036--1047"),
            ("doi", "10.1109/TVCG.2010.123"),
        ),
    ),
    "salvi2011": Paper(
        "inproceedings",
        "Salvi, Marco and Montgomery, Jefferson and Lefohn, Aaron",
        "Adaptive Transparency",
        "Proceedings of High Performance Graphics",
        2011,
        (("pages", "119--126"), ("doi", "10.1145/2018323.2018342")),
    ),
    "maule2013": Paper(
        "inproceedings",
        "Maule, Marilena and Comba, Jo{\\~a}o and Torchelsen, Rafael and Bastos, Rui",
        "Hybrid Transparency",
        _I3D,
        2013,
        (("pages", "103--118"), ("doi", "10.1145/2448196.2448212")),
    ),
    "mcguire2013": Paper(
        "article",
        "McGuire, Morgan and Bavoil, Louis",
        "Weighted Blended Order-Independent Transparency",
        "Journal of Computer Graphics Techniques ({JCGT})",
        2013,
        (
            ("volume", "2"),
            ("number", "2"),
            ("pages", "122--141"),
            ("url", "http://jcgt.org/published/0002/02/09/"),
        ),
    ),
    "salvi2014": Paper(
        "inproceedings",
        "Salvi, Marco and Vaidyanathan, Karthik",
        "Multi-layer Alpha Blending",
        _I3D,
        2014,
        (("pages", "151--158"), ("doi", "10.1145/2556700.2556705")),
    ),
    "mcguire2017": Paper(
        "article",
        "McGuire, Morgan and Mara, Michael",
        "Phenomenological Transparency",
        _TVCG,
        2017,
        (
            ("volume", "23"),
            ("number", "5"),
            ("pages", "1465--1478"),
            ("doi", "10.1109/TVCG.2017.2656082"),
        ),
    ),
    "wyman2017": Paper(
        "inproceedings",
        "Wyman, Chris and McGuire, Morgan",
        "Hashed Alpha Testing",
        _I3D,
        2017,
    ),
    "muenstermann2018": Paper(
        "article",
        'M{\\"u}nstermann, Cedrick and Krumpen, Stefan and Klein, Reinhard and Peters, Christoph',
        "Moment-Based Order-Independent Transparency",
        "Proceedings of the {ACM} on Computer Graphics and Interactive Techniques",
        2018,
        (("volume", "1"), ("number", "1"), ("pages", "7:1--7:20"), ("doi", "10.1145/3203206")),
    ),
    "sharpe2018": Paper(
        "inproceedings",
        "Sharpe, Brian",
        "Moment Transparency",
        "Proceedings of the Conference on High-Performance Graphics",
        2018,
        (("pages", "1--4"), ("doi", "10.1145/3231578.3231585")),
    ),
    "aizenshtein2022": Paper(
        "misc",
        "Aizenshtein, Maksim and Smal, Niklas and McGuire, Morgan",
        "Wavelet Transparency",
        "arXiv:2201.00094",
        2022,
        (("url", "https://arxiv.org/abs/2201.00094"),),
    ),
    "tsopouridis2024deep": Paper(
        "article",
        "Tsopouridis, Grigoris and Vasilakis, Andreas A. and Fudos, Ioannis",
        "Deep and Fast Approximate Order Independent Transparency",
        "Computer Graphics Forum",
        2024,
        (("pages", "e15071"), ("doi", "10.1111/cgf.15071")),
    ),
    "tsopouridis2024neural": Paper(
        "inproceedings",
        "Tsopouridis, Grigoris and Vasilakis, Andreas A. and Fudos, Ioannis",
        "Neural Moment Transparency",
        "Eurographics 2024, Short Papers",
        2024,
    ),
    "drobot2025": Paper(
        "misc",
        "Drobot, Michal",
        "Adaptive Voxel-Based Order-Independent Transparency",
        "{SIGGRAPH} 2025, Advances in Real-Time Rendering in Games",
        2025,
    ),
    "mueller2025": Paper(
        "misc",
        'M{\\"u}ller, Jan U. and Landsgesell, Robin Tim and van Holland, Leif and Stotko, Patrick '
        "and Klein, Reinhard",
        "Moment-Based {3D} {Gaussian} Splatting: Resolving Volumetric Occlusion with "
        "Order-Independent Transmittance",
        "arXiv:2512.11800",
        2025,
        (("url", "https://arxiv.org/abs/2512.11800"),),
    ),
    "hou2025": Paper(
        "inproceedings",
        "Hou, Qiqi and Rauwendaal, Randall and Li, Zifeng and Le, Hoang and Farhadzadeh, Farzad "
        "and Porikli, Fatih and Bourd, Alexei and Said, Amir",
        "Sort-free {Gaussian} Splatting via Weighted Sum Rendering",
        "International Conference on Learning Representations",
        2025,
        (("url", "https://arxiv.org/abs/2410.18931"),),
    ),
}

OWN_TITLE = "moit: order-independent transparency, techniques and errors from one core"


def _own_entry() -> str:
    fields = {"author": "{The moit authors}", "title": f"{{{OWN_TITLE}}}", "version": VERSION}
    lines = [f"  {name} = {{{value}}}," for name, value in fields.items()]
    return "\n".join(["@software{moit,", *lines, "}"])


def cite(*techniques: str | Technique) -> str:
    """BibTeX of the papers that techniques are from, oldest first, then of moit itself.

    techniques : techniques or their names, as `moit.technique` takes them; with options, since
        some have a source of their own. None: moit alone.

    Returns a text in ASCII, each entry once. What is ours has no paper but those that it builds on;
    of one's own technique, `PythonTechnique`, nothing is known. Raises as `moit.technique`.

    >>> print(moit.cite("wavelet8").split(",")[0])
    @misc{aizenshtein2022
    >>> moit.cite("power4", "trig3").count("@")
    2
    """
    wanted = {key for one in techniques for key in technique(one).cited}
    papers = [PAPERS[key].entry(key) for key in PAPERS if key in wanted]
    return "\n\n".join([*papers, _own_entry()])
