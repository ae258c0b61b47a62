"""Mutation test: make small random changes of the code and check that a test fails for each.

    python -m benchmarks.mutation [--count 30] [--seed 33] [--files 'pipeline/*.py' ...] [--table FILE]

A mutant is the program with one operator, comparison, constant or condition changed. Files and places are drawn with
the seed, so that every run of the same code has the same sample. In a copy of the tree, the tests that mirror the file
run (`tests/fe/test_mesh.py` of `fe/mesh.py`), then those that import the module, and then those of its folder, until
the first fails. A mutant that survives needs a new test or a reason why it changes nothing. A mutant of a compiled file
takes an additional minute of compilation.
"""

import argparse
import ast
import copy
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = (
    "geometry", "fe", "reduction", "hbsolve", "transient", "correlation", "diagnosis", "casefile", "pipeline", "study",
)  # fmt: skip
#: Time limit of each group of tests of a mutant [s]; a mutant that exceeds it counts as noticed.
LONGEST = 600.0
OPERATORS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.And: ast.Or, ast.Or: ast.And,
    ast.USub: ast.UAdd,
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """Changed file: path, line and description of the change, and the new text."""

    file: str
    line: int
    change: str
    text: str


@dataclass(frozen=True, kw_only=True)
class Judged:
    """Mutant and what noticed it: the first failed test, or the time limit; empty if it survived."""

    file: str
    line: int
    change: str
    noticed: str


def places(tree: ast.Module) -> Iterator[tuple[ast.AST, str]]:
    """Nodes that can be changed, and descriptions of the changes, without annotations and operations on texts."""
    skipped: set[int] = set()
    for node in ast.walk(tree):
        annotations = [getattr(node, name, None) for name in ("annotation", "returns")]
        for part in annotations:
            if isinstance(part, ast.AST):
                skipped.update(map(id, ast.walk(part)))
    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.BinOp) and _is_no_number(node.left):
            continue
        if isinstance(node, ast.BinOp | ast.BoolOp | ast.UnaryOp | ast.AugAssign) and type(node.op) in OPERATORS:
            yield node, f"{type(node.op).__name__} to {OPERATORS[type(node.op)].__name__}"
        elif isinstance(node, ast.Compare) and type(node.ops[0]) in OPERATORS:
            yield node, f"{type(node.ops[0]).__name__} to {OPERATORS[type(node.ops[0])].__name__}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
            yield node, f"{node.value} to {not node.value}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            yield node, f"{node.value} to {changed_number(node.value)}"
        elif isinstance(node, ast.If | ast.IfExp | ast.While):
            yield node, "condition negated"


def _is_no_number(node: ast.AST) -> bool:
    """Whether a node is a text, list or tuple, for which operators have other meanings."""
    is_text = isinstance(node, ast.Constant) and not isinstance(node.value, int | float)
    return is_text or isinstance(node, ast.JoinedStr | ast.List | ast.Tuple)


def changed_number(value: float) -> float:
    """Changed number: the next integer, or 1.5 times a float (1 for 0)."""
    return value + 1 if isinstance(value, int) else (1.5 * value if value else 1.0)


def mutate(node: ast.AST) -> None:
    """Change a node of `places`."""
    if isinstance(node, ast.BinOp | ast.BoolOp | ast.UnaryOp | ast.AugAssign):
        node.op = OPERATORS[type(node.op)]()  # type: ignore[assignment]
    elif isinstance(node, ast.Compare):
        node.ops[0] = OPERATORS[type(node.ops[0])]()  # type: ignore[assignment]
    elif isinstance(node, ast.Constant):
        assert isinstance(node.value, int | float)
        node.value = not node.value if isinstance(node.value, bool) else changed_number(node.value)
    elif isinstance(node, ast.If | ast.IfExp | ast.While):
        node.test = ast.UnaryOp(op=ast.Not(), operand=node.test)


def draw_mutants(files: Sequence[str], count: int, seed: int) -> list[Mutant]:
    """Draw mutants of different places, all places with equal probability."""
    trees = {file: ast.parse((ROOT / file).read_text(encoding="utf-8")) for file in files}
    every = [(file, number) for file, tree in trees.items() for number, _ in enumerate(places(tree))]
    drawn = random.Random(seed).sample(every, min(count, len(every)))
    mutants = []
    for file, number in drawn:
        tree = copy.deepcopy(trees[file])
        node, change = [*places(tree)][number]
        mutate(node)
        line = int(getattr(node, "lineno", 0))
        mutants.append(Mutant(file=file, line=line, change=change, text=ast.unparse(ast.fix_missing_locations(tree))))
    return mutants


def find_tests(file: str) -> list[list[str]]:
    """Groups of tests of a file: the mirror of the file, tests that import the module, other tests of the folder."""
    path = Path(file)
    module = ".".join(path.with_suffix("").parts)
    folder = ROOT / "tests" / path.parent
    while not folder.is_dir():
        folder = folder.parent
    all_tests = sorted((ROOT / "tests").rglob("test_*.py"))
    mirror = [test for test in all_tests if test.name == f"test_{path.stem}.py" and folder in test.parents]
    naming = [
        test for test in all_tests if test not in mirror and f"{module} import" in test.read_text(encoding="utf-8")
    ]
    rest = [test for test in sorted(folder.glob("test_*.py")) if test not in [*mirror, *naming]]
    groups = [mirror, naming, rest]
    return [[str(test.relative_to(ROOT)) for test in group] for group in groups if group]


def judge(mutant: Mutant, tree: Path) -> Judged:
    """Run the tests of a mutant in a copy of the tree until the first test fails."""
    file = tree / mutant.file
    original = file.read_text(encoding="utf-8")
    file.write_text(mutant.text, encoding="utf-8")
    noticed = ""
    try:
        for tests in find_tests(mutant.file):
            noticed = run_tests(tests, tree)
            if noticed:
                break
    finally:
        file.write_text(original, encoding="utf-8")
    return Judged(file=mutant.file, line=mutant.line, change=mutant.change, noticed=noticed)


def run_tests(tests: Sequence[str], tree: Path) -> str:
    """Run tests; returns the first failed test, or an empty string."""
    environment = {
        **os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1",
        "MKL_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip
    words = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "--no-header", *tests]
    process = subprocess.Popen(
        words, cwd=tree, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True,
    )  # fmt: skip
    try:
        output, _ = process.communicate(timeout=LONGEST)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return f"hangs in {tests[0]}"
    if process.returncode == 0:
        return ""
    failed = [line for line in output.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    return failed[0].split(" - ")[0] if failed else f"pytest ended with {process.returncode}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print each mutant and the fraction that was noticed."""
    words = argparse.ArgumentParser(prog="python -m benchmarks.mutation", description=__doc__)
    words.add_argument("--count", type=int, default=30)
    words.add_argument("--seed", type=int, default=33)
    words.add_argument("--files", nargs="*", default=[], help="patterns of files; by default the whole product")
    words.add_argument("--table", type=Path, help="JSON lines of what was judged; what is in it is not run again")
    given = words.parse_args(arguments)
    patterns = given.files or [f"{room}/**/*.py" for room in ROOMS]
    files = sorted({str(file.relative_to(ROOT)) for pattern in patterns for file in ROOT.glob(pattern)})
    lines = given.table.read_text(encoding="utf-8").splitlines() if given.table and given.table.exists() else []
    known = [Judged(**json.loads(line)) for line in lines]
    done = {(item.file, item.line, item.change): item for item in known}
    result = []
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, symlinks=True, ignore=shutil.ignore_patterns(".git", "*_cache", "__pycache__"))
        for mutant in draw_mutants(files, given.count, given.seed):
            judged = done.get((mutant.file, mutant.line, mutant.change))
            if judged is None:
                judged = judge(mutant, tree)
                if given.table:
                    with given.table.open("a", encoding="utf-8") as stream:
                        stream.write(json.dumps(asdict(judged)) + "\n")
            result.append(judged)
            print(f"{judged.file}:{judged.line}  {judged.change}  {judged.noticed or 'SURVIVED'}", flush=True)
    n_noticed = sum(bool(item.noticed) for item in result)
    print(f"{n_noticed} of {len(result)} mutants were noticed ({100 * n_noticed / max(len(result), 1):.0f} %)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
