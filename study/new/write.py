"""Writing of a first case: the structure is made, and load, sensor and a sweep over the first resonance are added."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import InputError
from pipeline.output import replace_file
from study.case.structure import Structure
from study.kind.registry import open_case
from study.new.blade import draft_blade
from study.new.draft import CaseDraft, Drafter, NewCaseRequest
from study.new.matrices import draft_matrices
from study.new.part import draft_part
from study.new.plain import draft_plain
from study.new.rig import draft_rig
from study.run_context import RunContext

DRAFTERS: Mapping[str, Drafter] = {
    "blade": draft_blade,
    "rig": draft_rig,
    "part": draft_part,
    "matrices": draft_matrices,
    "plain": draft_plain,
}
#: Half-width of the sweep, relative to the first natural frequency [-].
BAND = 0.1
#: Largest frequency of a rigid motion, relative to the seventh frequency, or to the last one of fewer [-].
RIGID = 1e-3


@dataclass(frozen=True, kw_only=True)
class NewCase:
    """A written case.

    Parameters
    ----------
    path
        Path of the case file.
    draft
        Draft of the case.
    frequency
        First natural frequency [Hz]; None for a rig, whose sweep is known.
    """

    path: Path
    draft: CaseDraft
    frequency: float | None = None


@dataclass(frozen=True, kw_only=True)
class DrivePoint:
    """Point at which the structure is driven and measured: keys of the place, and name."""

    keys: str
    name: str


def write_new_case(kind: str, request: NewCaseRequest, run: RunContext) -> NewCase:
    """Write a case of a kind.

    Parameters
    ----------
    kind
        Name in `DRAFTERS`.
    request
        Files and options.
    run
        Run that stores the structure for the next command.

    Raises
    ------
    InputError
        A file cannot be used, or an option is invalid. The earlier file at the path is restored.
    """
    for file in request.files:
        if not file.is_file():
            raise InputError(f"{file}: there is no such file; check the spelling and the folder")
    with _restore_if_it_fails(request.path):
        return _write(kind, request, run)


def _write(kind: str, request: NewCaseRequest, run: RunContext) -> NewCase:
    draft = DRAFTERS[kind](request, run)
    head = f'{HEAD}\nschema = 2\ntitle = "{_make_title(request.path)}"\n\n{draft.text}'
    replace_file(request.path, head)
    opened = open_case(request.path)
    if draft.is_whole:
        return NewCase(path=request.path, draft=draft)
    structure = opened.kind.structure(opened, run)
    frequency, point = _find_first_mode(structure)
    tables = [] if structure.sensors else [SENSOR.format(name=point.name, keys=point.keys)]
    if not structure.places:
        tables.append(PLACE.format(keys=point.keys))
    if structure.harmonic_force is None:
        tables.insert(0, LOAD.format(keys=point.keys))
    tables += [JOINT.format(keys=_comment_out(point.keys)), SWEEP.format(**_choose_range(frequency))]
    replace_file(request.path, "\n".join([head.rstrip() + "\n", *tables]))
    open_case(request.path)
    return NewCase(path=request.path, draft=draft, frequency=frequency)


@contextmanager
def _restore_if_it_fails(path: Path) -> Iterator[None]:
    """Restore the file after a failure, or remove a new one, so that no incomplete case is left."""
    before = path.read_bytes() if path.is_file() else None
    try:
        yield
    except BaseException:
        with suppress(OSError):
            if before is None:
                path.unlink(missing_ok=True)
            else:
                replace_file(path, before)
        raise


def _find_first_mode(structure: Structure) -> tuple[float, DrivePoint]:
    """Find the frequency of the first elastic mode [Hz], and the point of largest motion that a case can name."""
    matrices = structure.matrices
    squared, shapes = scipy.linalg.eigh(matrices.stiffness, matrices.mass)
    elastic = squared > RIGID**2 * abs(squared[min(6, len(squared) - 1)])
    if not elastic.any():
        raise InputError("the structure has no natural frequency above zero: check the stiffness")
    first = int(elastic.argmax())
    shape = np.abs(shapes[:, first])
    return float(np.sqrt(squared[first])) / (2 * np.pi), _drive_point(structure, shape)


def _drive_point(structure: Structure, shape: Float[NDArray[np.float64], " r"]) -> DrivePoint:
    if structure.places:
        return DrivePoint(keys='place = "excitation"' if "excitation" in structure.places else "", name="tip")
    named = [number for number, dof in enumerate(structure.dofs) if dof.direction in ("x", "y", "z")]
    if not named:
        dof = int(shape.argmax())
        return DrivePoint(keys=f"dof = {dof}", name=f"dof {dof}")
    best = max(named, key=lambda number: shape[number])
    result = structure.dofs[best]
    if structure.matrices.rom is not None:
        return DrivePoint(keys=f'at = "{result.body}"\ndirection = "{result.direction}"', name=result.body)
    body = f'body = "{result.body}"\n' if result.body else ""
    return DrivePoint(keys=f'{body}node = {result.node}\ndirection = "{result.direction}"', name=f"node {result.node}")


def _choose_range(frequency: float) -> dict[str, str]:
    ends = {"first": (1 - BAND) * frequency, "last": (1 + BAND) * frequency, "step": BAND * frequency / 50}
    return {name: f"{value:.4g}" for name, value in ends.items()} | {"resonance": f"{frequency:.5g}"}


def _make_title(path: Path) -> str:
    return path.stem.replace("_", " ").capitalize()


def _comment_out(keys: str) -> str:
    return "\n".join(f"# {line}" for line in keys.splitlines())


HEAD = """\
# A first case, written by `stickslip new`. Quantities are text with a unit, lines that begin with # are comments.
# docs/case.md describes every key. Try it: stickslip reduce, modes, solve."""
LOAD = """\
# 1 N cos(Omega t). The levels of [sweep] multiply it.
[[load]]
{keys}
amplitude = "1 N"
"""
SENSOR = """\
# What solve draws, and what compare compares with a channel of the same name.
[[sensor]]
name = "{name}"
{keys}
"""
PLACE = """\
# A name for this place, which measurements may refer to and effects may act at. `stickslip campaign new` assumes "tip".
[[place]]
name = "tip"
{keys}
"""
JOINT = """\
# The structure is linear so far. A joint between this place and the ground, for example a spring with a slider that
# slips at 2 N (docs/case.md lists all kinds of joints):
# [[joint]]
# kind = "jenkins"
# name = "rub"
{keys}
# tangential_stiffness = "0.1 N/um"
# limit_force = "2 N"
"""
SWEEP = """\
# The response is followed through the first resonance, at {resonance} Hz without joints.
[sweep]
from = "{first} Hz"
to = "{last} Hz"
step = "{step} Hz"
levels = [1]

[harmonics]
highest = 5 # 1 would do for a linear structure; friction needs odd ones
"""
