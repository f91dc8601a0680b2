"""Tsopouridis, Vasilakis, Fudos, "Neural Moment Transparency", Eurographics Short Papers 2024:
figures 1 and 4 and table 1."""

from __future__ import annotations

from moit.experiments.claims import Claim, Less, Near, Of
from moit.experiments.comparisons import Comparison, Timing
from moit.experiments.description import Experiment, Published

PAPER = "Neural Moment Transparency (Tsopouridis et al. 2024)"
NMT, DFA, EXACT = "neural", "dfa", "sorted"
MB = "power4(bias='published')"
OURS = ("neural(depth_range='pixel')", "neural-bounded", "neural-bounded6")

# Of the kinds of the paper's Sibenik, engine, hair and smoke, with its opacities.
HALL, ENGINE, HAIR, SMOKE = "teapots", "engine", "hair", "smoke"
ALPHAS = {HALL: 0.3, ENGINE: 0.15, HAIR: 0.2, SMOKE: 0.3}
WHAT = (
    "Scenes of the kinds of the paper's, with its opacities: a hall with pots for Sibenik (.3), an "
    "engine (.15), hair (.2), smoke (.3). Its depth complexities are 31, 52, 172 and 24. The "
    "networks are those that come with moit, trained in minutes where the paper takes hours: the "
    "paper's own have no licence."
)


def _of(column: str, technique: str, scene: str) -> Of:
    return Of(column, technique, scene)


QUALITY = Experiment(
    name="nmt-quality",
    paper=PAPER,
    figure="figures 1 and 4",
    title="a network that reads transmittance off four moments",
    about=f"{WHAT} The paper's numbers are in its pictures, FLIP and MSE, and not in its text.",
    parts=(
        Comparison(
            "Pictures and errors",
            "Beside the paper's three techniques stand moit's bounded networks, six power moments "
            "and three trigonometric ones, which the paper names as variants.",
            tuple(ALPHAS),
            (MB, DFA, NMT, *OURS, "power6", "trig3"),
            columns=("bits_per_pixel", "flip", "ssim", "rmse", "T_mae", "T_p99"),
            shown=(MB, DFA, NMT, "neural-bounded"),
            alphas=ALPHAS,
        ),
    ),
    claims=(
        Claim(
            "Neural moments are better than four power moments.",
            "section 5",
            tuple(Less(_of("flip", NMT, scene), _of("flip", MB, scene)) for scene in ALPHAS),
        ),
        Claim(
            "By 20 to 50 %.",
            "abstract, section 5",
            tuple(Less(_of("flip", NMT, scene), _of("flip", MB, scene), 0.8) for scene in ALPHAS),
        ),
        Claim(
            "They are better than deep and fast transparency, and that better than four power "
            "moments.",
            "section 5",
            tuple(
                test
                for scene in ALPHAS
                for test in (
                    Less(_of("flip", NMT, scene), _of("flip", DFA, scene)),
                    Less(_of("flip", DFA, scene), _of("flip", MB, scene)),
                )
            ),
        ),
        Claim(
            "Other moments improve quality further, at more memory or time.",
            "section 5",
            tuple(
                Less(_of("flip", one, scene), _of("flip", MB, scene))
                for scene in ALPHAS
                for one in ("power6", "trig3")
            ),
        ),
    ),
)

_MS = {
    HALL: (15.0, 3.0, 4.3, 5.2),
    ENGINE: (5.3, 1.3, 2.0, 2.3),
    HAIR: (17.2, 3.3, 6.7, 8.0),
    SMOKE: (7.9, 2.6, 3.9, 4.6),
}
_LISTED = (EXACT, DFA, MB, NMT)
_TIMES: dict[tuple[str | None, str], float] = {
    (scene, name): spent
    for scene, row in _MS.items()
    for name, spent in zip(_LISTED, row, strict=True)
}
_BITS = {DFA: 352, MB: 320, NMT: 352}

TABLE_1 = Experiment(
    name="nmt-table1",
    paper=PAPER,
    figure="table 1",
    title="run times and memory",
    about=(
        f"{WHAT} Milliseconds for a picture beside the paper's, which are of its own scenes at "
        "1920 x 1080 on an NVIDIA RTX 2080 Super. Ratios compare: 1 is four power moments. On a "
        "processor the fragments are there already, as arrays, and sorting them is cheap; on a "
        "GPU triangles are drawn."
    ),
    parts=(
        Comparison(
            "Times, memory and errors",
            "`bytes` as the paper counts them, colour buffers too.",
            tuple(ALPHAS),
            (*_LISTED, *OURS),
            columns=("bytes", "ms", "ratio", "flip", "rmse", "T_mae"),
            shown=(),
            alphas=ALPHAS,
            bytes_of="NMT",
            timing=Timing(MB),
            published=Published(
                "NMT, table 1",
                "RTX 2080 Super, 2024",
                {
                    "paper_bytes": {(None, name): bits / 8 for name, bits in _BITS.items()},
                    "paper_ms": _TIMES,
                },
            ),
        ),
    ),
    claims=(
        Claim(
            "Memory is 352 bits a pixel, and 320 for four power moments.",
            "section 5",
            tuple(Near(_of("bytes", name, HALL), bits / 8, 0.0) for name, bits in _BITS.items()),
        ),
        Claim(
            "Neural moments take about 15 % more time than four power moments.",
            "section 5, table 1",
            tuple(Less(_of("ms", NMT, scene), _of("ms", MB, scene), 1.3) for scene in ALPHAS),
        ),
        Claim(
            "Deep and fast transparency is faster than both.",
            "table 1",
            tuple(Less(_of("ms", DFA, scene), _of("ms", MB, scene)) for scene in ALPHAS),
        ),
        Claim(
            "All are several times as fast as an A-buffer.",
            "table 1",
            tuple(Less(_of("ms", NMT, scene), _of("ms", EXACT, scene), 0.67) for scene in ALPHAS),
        ),
    ),
)

EXPERIMENTS = (QUALITY, TABLE_1)
