"""The architecture as the sources say it: writes the tree into architecture.md and draws the two ways.

The line of a folder is the first sentence of its docstring. An arrow of the picture is an import, read from the sources
as `pipeline.code_dependencies` reads them; a registry imports the members of its package. ``python
docs/draw_architecture.py`` writes both; nothing of the product is run.
"""

import ast
import re
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCUMENT = ROOT / "docs" / "architecture.md"
PICTURE = ROOT / "docs" / "pictures" / "architecture.png"
PACKAGES = (
    "stickslip", "study", "figure", "pipeline", "casefile", "diagnosis", "correlation", "transient", "hbsolve",
    "reduction", "fe", "geometry",
)  # fmt: skip
#: One per package, pale enough for black letters.
COLOURS = (
    "#ffffff", "#f3e3c3", "#f6d5d5", "#e3e3e3", "#fff3b8", "#e6d5f0", "#d5e3f6", "#cfe8e8", "#cdeccd", "#d9f0c0",
    "#f0d9c0", "#e0e0c8",
)  # fmt: skip
BEGIN, END = "<!-- tree: written by docs/draw_architecture.py -->", "<!-- end of tree -->"


@dataclass(frozen=True, kw_only=True)
class Way:
    """What passes through the files, from a command to the numerical packages.

    Parameters
    ----------
    title
        Of its half of the picture.
    legs
        Pairs of modules: from the first, imports lead to the second.
    what
        What happens in a module.
    """

    title: str
    legs: Sequence[tuple[str, str]]
    what: Mapping[str, str]


WAYS = (
    Way(
        title="The way of a case: stickslip solve",
        legs=(
            ("study.command.solve", "study.solve.run"),
            ("study.solve.run", "study.kind.registry"),
            ("study.kind.registry", "casefile.table"),
            ("study.kind.registry", "study.kind.rig.structure"),
            ("study.kind.rig.structure", "study.kind.rig.reduction"),
            ("study.kind.rig.reduction", "fe.mesher.rig"),
            ("study.kind.rig.structure", "reduction.craig_bampton"),
            ("study.solve.run", "study.case.setup"),
            ("study.case.setup", "study.case.model"),
            ("study.case.model", "correlation.model"),
            ("study.solve.run", "study.solve.model"),
            ("study.solve.run", "hbsolve.continuation.response"),
            ("hbsolve.continuation.response", "hbsolve.joint_law"),
            ("study.solve.run", "figure.response_curves"),
        ),
        what={
            "study.command.solve": "the command",
            "study.solve.run": "the run, and its files",
            "study.kind.registry": "opens the case",
            "casefile.table": "TOML to checked values",
            "study.kind.rig.structure": "values to a structure",
            "fe.mesher.rig": "meshes",
            "reduction.craig_bampton": "reduced matrices",
            "study.case.setup": "reads the whole case",
            "study.case.model": "joints, loads, sensors",
            "correlation.model": "the model",
            "study.solve.model": "the curves asked for",
            "hbsolve.continuation.response": "response curves",
            "hbsolve.joint_law": "forces of joints",
            "figure.response_curves": "arrays to a picture",
        },
    ),
    Way(
        title="The way of a campaign: stickslip diagnose",
        legs=(
            ("study.command.diagnose", "study.diagnose.run"),
            ("study.diagnose.run", "correlation.campaign.read_campaign"),
            ("study.diagnose.run", "study.case.setup"),
            ("study.diagnose.run", "study.diagnose.round"),
            ("study.diagnose.round", "diagnosis.diagnose"),
            ("diagnosis.diagnose", "diagnosis.effect"),
            ("diagnosis.diagnose", "diagnosis.fit.refit"),
            ("diagnosis.diagnose", "diagnosis.fit.arrangement"),
            ("diagnosis.fit.arrangement", "diagnosis.fit.comparison"),
            ("diagnosis.fit.comparison", "hbsolve.steady_state"),
            ("diagnosis.diagnose", "diagnosis.decision.rules"),
            ("study.diagnose.run", "study.diagnose.page"),
        ),
        what={
            "study.command.diagnose": "the command",
            "study.diagnose.run": "the run, and its files",
            "correlation.campaign.read_campaign": "files to measurements",
            "study.case.setup": "case to model",
            "study.diagnose.round": "one round, in stored steps",
            "diagnosis.diagnose": "what is missing?",
            "diagnosis.effect": "what may be missing",
            "diagnosis.fit.refit": "fits of each candidate",
            "diagnosis.fit.arrangement": "all that a fit needs",
            "diagnosis.fit.comparison": "weighted differences",
            "correlation.prediction": "predicted readings",
            "correlation.model_solver": "with or without contacts",
            "hbsolve.steady_state": "periodic responses",
            "diagnosis.decision.rules": "the verdict",
            "study.diagnose.page": "the page to look at",
        },
    ),
)


def docstring(package: Path) -> str:
    """First sentence of a package's docstring, without its full stop."""
    text = ast.get_docstring(ast.parse((package / "__init__.py").read_text(encoding="utf-8"))) or ""
    return re.split(r"\.(?:\s|$)", " ".join(text.split()), maxsplit=1)[0].replace("``", "`")


def folders(package: Path) -> Iterator[Path]:
    """A package and those within it, each before what it holds."""
    yield package
    for item in sorted(package.iterdir()):
        if (item / "__init__.py").is_file():
            yield from folders(item)


def tree() -> str:
    """One line per folder of the product."""
    result = []
    for package in PACKAGES:
        for folder in folders(ROOT / package):
            depth = len(folder.relative_to(ROOT).parts) - 1
            result.append(f"{'    ' * depth}{folder.name}/".ljust(20) + f" {docstring(folder)}")
    return "\n".join(result)


@cache
def module_files() -> Mapping[str, Path]:
    """File of each module of the product, by import name."""
    result = {}
    for package in PACKAGES:
        for file in sorted((ROOT / package).rglob("*.py")):
            parts = file.relative_to(ROOT).with_suffix("").parts
            result[".".join(part for part in parts if part != "__init__")] = file
    return result


@cache
def imports(module: str) -> tuple[str, ...]:
    """Modules of the product that one imports, within functions too, and the members of its registries."""
    result: dict[str, None] = {}
    for node in ast.walk(ast.parse(module_files()[module].read_bytes())):
        if isinstance(node, ast.Import):
            result |= dict.fromkeys(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            result |= dict.fromkeys([*(f"{node.module}.{alias.name}" for alias in node.names), node.module])
        elif isinstance(node, ast.Call):
            for keyword in node.keywords:
                value = keyword.value.value if isinstance(keyword.value, ast.Constant) else None
                if keyword.arg == "package" and isinstance(value, str):
                    head = f"{value}."
                    result |= dict.fromkeys(
                        item for item in module_files() if item.startswith(head) and "." not in item[len(head) :]
                    )
    return tuple(item for item in result if item in module_files() and item != module)


def chain(start: str, stop: str) -> list[str]:
    """A shortest chain of imports from one module to another, both included.

    Raises
    ------
    LookupError
        No imports lead there.
    """
    came_from: dict[str, str] = {start: ""}
    waiting = deque([start])
    while waiting:
        module = waiting.popleft()
        if module == stop:
            result = [module]
            while came_from[result[-1]]:
                result.append(came_from[result[-1]])
            return result[::-1]
        for item in imports(module):
            if item not in came_from:
                came_from[item] = module
                waiting.append(item)
    raise LookupError(f"no imports lead from {start} to {stop}: name another stop in docs/draw_architecture.py")


def links(way: Way) -> list[tuple[str, str]]:
    """The imports of a way, in order, each once."""
    result: dict[tuple[str, str], None] = {}
    for start, stop in way.legs:
        modules = chain(start, stop)
        result |= dict.fromkeys(pairwise(modules))
    return list(result)


def columns(way: Way) -> list[list[str]]:
    """Modules of a way by how many imports lie before each at most."""
    pairs = links(way)
    depth = dict.fromkeys((module for pair in pairs for module in pair), 0)
    for _ in depth:
        for start, stop in pairs:
            depth[stop] = max(depth[stop], depth[start] + 1)
    return [[module for module, own in depth.items() if own == column] for column in range(max(depth.values()) + 1)]


def draw(file: Path) -> None:
    """Both ways, one below the other: a box is a file, an arrow an import, a colour a package."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    colour = dict(zip(PACKAGES, COLOURS, strict=True))
    grids = [columns(way) for way in WAYS]
    rows = [max(map(len, grid)) for grid in grids]
    width, height = max(map(len, grids)), sum(rows) + len(rows)
    figure = Figure(figsize=(2.05 * width, 0.85 * height), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    for axes, way, grid in zip(figure.subplots(len(WAYS), 1, height_ratios=rows), WAYS, grids, strict=True):
        place: dict[str, tuple[float, float]] = {}
        for number, column in enumerate(grid):
            for row, module in enumerate(column):
                place[module] = (float(number), (len(column) - 1) / 2 - row)
        boxes = {}
        for module, (x, y) in place.items():
            package, _, name = module.partition(".")
            boxes[module] = axes.text(
                x, y, "\n".join([package, name, way.what.get(module, "")]).strip(),
                ha="center", va="center", fontsize=9.5, linespacing=1.25,
                bbox={"boxstyle": "round,pad=0.35", "facecolor": colour[package], "edgecolor": "0.4", "lw": 0.8},
            )  # fmt: skip
        for start, stop in links(way):
            ends = {"patchA": boxes[start].get_bbox_patch(), "patchB": boxes[stop].get_bbox_patch()}
            axes.annotate(
                "", place[stop], place[start], arrowprops={"arrowstyle": "-|>", "color": "0.45", "lw": 1.1} | ends
            )
        tallest = max(map(len, grid))
        axes.set(xlim=(-0.55, width - 0.45), ylim=(-tallest / 2 - 0.05, tallest / 2 + 0.05))
        axes.set_title(way.title, loc="left", fontsize=12)
        axes.axis("off")
    figure.savefig(file)


def write_tree(file: Path) -> None:
    """Put the tree of today between its two marks in the document."""
    before, rest = file.read_text(encoding="utf-8").split(BEGIN)
    behind = rest.split(END)[1]
    lines = "".join(f"    {line}\n" for line in tree().splitlines())
    file.write_text(f"{before}{BEGIN}\n\n{lines}\n{END}{behind}", encoding="utf-8")


if __name__ == "__main__":
    write_tree(DOCUMENT)
    draw(PICTURE)
