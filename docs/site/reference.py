"""Pages of the reference, from signatures and docstrings: one a subject; all that is public."""

from __future__ import annotations

import inspect
import re
import types
from pathlib import Path
from typing import Any

import moit

# Subject -> what it says of itself, and the names under it; modules stand for all they have.
SUBJECTS: dict[str, tuple[str, tuple[str, ...]]] = {
    "Questions": (
        "What one asks of fragments and a technique.",
        (
            "composite",
            "transmittance",
            "total_transmittance",
            "bounds",
            "moments",
            "composite_deep",
        ),
    ),
    "Fragments": (
        "The one input: what lies along the ray of each pixel.",
        ("Fragments", "Frame", "merge", "load", "save", "scenes"),
    ),
    "Techniques": (
        "Every technique and its options. [Pages of their own](../techniques/index.md) say what "
        "each is good at.",
        ("technique", "techniques", "cite", "Technique", "PythonTechnique", "storage"),
    ),
    "Meshes, splats, lines and volumes": (
        "What fragments are drawn from, and pictures.",
        (
            *("rasterize", "render", "Rendering", "Camera", "Light", "ShadowMap"),
            *("Mesh", "Texture", "read_mesh", "read_meshes", "Splats", "read_splats"),
            *("write_splats", "SortFree", "SortFreeSplats", "read_sort_free", "Points", "Lines"),
            *("Volume", "map_scalars", "popping", "Popping"),
        ),
    ),
    "Measuring and choosing": (
        "Errors, times, proofs, and which technique to take.",
        (
            *("compare", "Report", "recommend", "Recommendation", "choose", "Choice", "frontier"),
            *("Frontier", "stability", "StabilityReport", "check_technique", "TechniqueCheck"),
            *("bias_advice", "BiasAdvice", "errors", "metrics", "experiment", "ExperimentResult"),
        ),
    ),
    "Deep images and files": (
        "Deep OpenEXR in and out, and images.",
        (
            *("deep", "read_deep", "read_deep_bands", "write_deep", "inspect"),
            *("read_image", "write_image"),
        ),
    ),
    "Gradients and networks": (
        "Derivatives of pictures, and networks that are trained.",
        ("gradients", "train", "Network"),
    ),
    "Showing": ("Pictures and charts.", ("show", "ShownImage", "plot")),
    "GPU and export": ("OpenGL 4.5 passes, and includes for engines.", ("gpu", "export", "info")),
    "Errors": ("What is raised.", ()),
}


def subjects() -> dict[str, list[str]]:
    """Subject -> public names of `moit` in order; each has one place."""
    found = {title: list(names) for title, (_, names) in SUBJECTS.items()}
    placed = {name for names in found.values() for name in names}
    for name in moit.__all__:
        one = getattr(moit, name)
        if name in placed:
            continue
        if inspect.isclass(one) and issubclass(one, Exception):
            found["Errors"].append(name)
        elif inspect.isclass(one) and issubclass(one, moit.Technique):
            found["Techniques"].append(name)
        else:
            raise ValueError(f"docs/site/reference.py: moit.{name} is public, and under no subject")
    return found


def members(module: types.ModuleType) -> list[str]:
    """What a module has of its own, or lists as its own."""
    listed = getattr(module, "__all__", None)
    if listed is not None:
        return list(listed)
    return [
        name
        for name, one in vars(module).items()
        if not name.startswith("_") and getattr(one, "__module__", "") == module.__name__
    ]


def public() -> set[str]:
    """All that can be linked to, by its whole name."""
    names = set()
    for name in moit.__all__:
        one = getattr(moit, name)
        names.add(f"moit.{name}")
        if isinstance(one, types.ModuleType):
            names |= {f"moit.{name}.{inner}" for inner in members(one)}
        elif inspect.isclass(one):
            names |= {f"moit.{name}.{inner}" for inner in methods(one)}
    return names


def methods(one: type) -> list[str]:
    """Of a class what has a docstring and is not private."""
    technique = issubclass(one, moit.Technique) and one is not moit.Technique
    return [
        name
        for name, what in inspect.getmembers_static(one)
        if not (technique and name not in vars(one))  # those of all stand at Technique
        and not name.startswith("_")
        and (inspect.isfunction(unwrapped(what)) or isinstance(what, property))
        and what.__doc__
        and not issubclass(one, Exception)
    ]


def unwrapped(one: Any) -> Any:
    return getattr(one, "__func__", one)


def signature(one: Any) -> str:
    """Parameters with defaults, without annotations, which docstrings say in words."""
    try:
        found = inspect.signature(one)
    except (TypeError, ValueError):
        return ""
    bare = [p.replace(annotation=p.empty) for p in found.parameters.values()]
    text = str(found.replace(parameters=bare, return_annotation=found.empty))
    return re.sub(r"<[^<>]*>", "...", text)  # a default that has no short name


PARAMETER = re.compile(r"^(\*{0,2}\w[\w*, .]*?) : ")
SPECIAL = re.compile(r"([\\*_<>\[\]$#|{}~^])")


def escaped(text: str, known: set[str]) -> str:
    """A paragraph as MyST: code in backticks, links to what is public, no letter with a meaning."""
    parts = text.split("`")
    for index, part in enumerate(parts):
        if index % 2 == 0:
            parts[index] = SPECIAL.sub(r"\\\1", part)
        elif part in known:
            parts[index] = f"{{py:obj}}`{part}`"
        else:
            parts[index] = f"`{part}`"
    return "".join(parts)


def myst(docstring: str, known: set[str]) -> str:
    """A docstring in the house's form as MyST: paragraphs, parameters, lists, examples."""
    blocks = []
    for block in re.split(r"\n\s*\n", docstring.strip("\n")):
        lines = block.splitlines()
        if block.lstrip().startswith(">>>"):
            blocks.append("```pycon\n" + inspect.cleandoc(block) + "\n```")
        elif all(line.startswith("    ") for line in lines):
            blocks.append("```text\n" + inspect.cleandoc(block) + "\n```")
        elif lines[0].startswith("- "):
            items = re.split(r"^- ", block, flags=re.MULTILINE)[1:]
            blocks.append("\n".join("- " + escaped(" ".join(i.split()), known) for i in items))
        else:
            blocks += paragraphs(lines, known)
    return "\n\n".join(blocks)


def paragraphs(lines: list[str], known: set[str]) -> list[str]:
    """A block of text, in which parameters are terms of a list of definitions."""
    found: list[tuple[str, list[str]]] = []
    for line in lines:
        starts = PARAMETER.match(line)
        if starts:
            found.append((starts[1], [line[starts.end() :]]))
        elif found and (line.startswith("    ") or not found[-1][0]):
            found[-1][1].append(line.strip())
        else:
            found.append(("", [line.strip()]))
    made = []
    for name, texts in found:
        text = escaped(" ".join(texts), known)
        made.append(f"`{name}`\n: {text}" if name else text)
    return made


def entry(name: str, one: Any, known: set[str], depth: int = 6) -> str:
    """The directive of a function, a class with its methods, or a module's contents."""
    fence = ":" * depth
    if isinstance(one, types.ModuleType):
        parts = [
            f"## {name}",
            "",
            f"```{{py:module}} {name}\n```",
            "```{py:currentmodule} None\n```",
            "",
            myst(inspect.getdoc(one) or "", known),
            "",
        ]
        for inner in members(one):
            what = getattr(one, inner)
            if callable(what):
                parts += [entry(f"{name}.{inner}", what, known), ""]
        return "\n".join(parts)
    kind = "function"
    if inspect.isclass(one):
        kind = "exception" if issubclass(one, Exception) else "class"
    body = [myst(inspect.getdoc(one) or "", known)]
    if kind == "class":
        for inner in methods(one):
            what = inspect.getattr_static(one, inner)
            text = myst(inspect.getdoc(what) or "", known)
            if isinstance(what, property):
                head = f"{{py:property}} {name}.{inner}"
            else:
                bound = getattr(one, inner) if unwrapped(what) is not what else what
                head = f"{{py:method}} {name}.{inner}{of_instances(signature(bound))}"
            inner_fence = ":" * (depth - 2)
            body.append(f"{inner_fence}{head}\n\n{text}\n{inner_fence}")
    said = signature(one) if kind != "exception" else ""
    return f"{fence}{{py:{kind}}} {name}{said}\n\n" + "\n\n".join(body) + f"\n{fence}\n"


def of_instances(text: str) -> str:
    return re.sub(r"^\(self(, )?", "(", text)


def write_pages(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    known, names = public(), []
    for title, listed in subjects().items():
        file = re.sub(r"\W+", "_", title.lower()).strip("_")
        names.append(file)
        parts = [f"# {title}", "", SUBJECTS[title][0], ""]
        ordered = sorted(listed, key=lambda n: isinstance(getattr(moit, n), types.ModuleType))
        for name in ordered:
            parts += [entry(f"moit.{name}", getattr(moit, name), known), ""]
        (folder / f"{file}.md").write_text("\n".join(parts), encoding="utf-8")
    contents = ["# Reference", "", "```{toctree}", *names, "```", ""]
    (folder / "index.md").write_text("\n".join(contents), encoding="utf-8")
