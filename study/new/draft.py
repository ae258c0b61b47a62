"""Draft of a first case: the request of the user, and the text of the structure."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from study.campaign.question import Answers, Marked, Question
from study.run_context import RunContext


@dataclass(frozen=True, kw_only=True)
class NewCaseRequest:
    """The user's request for a new case.

    Parameters
    ----------
    path
        Path of the new case file.
    files
        Files of the structure: a STEP or mesh file, or matrices.
    fix
        Fixed faces, sets or nodes.
    given
        Other values as text, by the name of their option.
    answers
        Source of answers for values that are not given.
    """

    path: Path
    files: tuple[Path, ...]
    fix: tuple[str, ...]
    given: dict[str, str]
    answers: Answers

    def value(self, option: str, question: str, default: str, why: str, choices: Sequence[str] = ()) -> Marked:
        """Return the value of an option, or the answer to a question if the option is not given."""
        if option in self.given:
            return Marked(value=self.given[option])
        return self.answers.ask(Question(text=question, default=default, why=why, choices=choices))

    @staticmethod
    def millimetres(option: str, marked: Marked) -> float:
        """Read a length with a unit, and convert it to millimetres."""
        from casefile.quantity import LENGTH
        from geometry.errors import InputError
        from geometry.part import MILLIMETRES_PER_METRE

        try:
            length = LENGTH.read(marked.value) * MILLIMETRES_PER_METRE
        except ValueError as error:
            raise InputError(f"--{option} {marked.value}: {error}") from None
        if not length > 0:
            raise InputError(f"--{option} {marked.value}: a length must be positive")
        return float(f"{length:.6g}")

    def relative(self, file: Path) -> str:
        """Format the name of a file for the case: relative to the folder of the case, with slashes, quoted."""
        return f'"{Path(os.path.relpath(file, self.path.parent)).as_posix()}"'


@dataclass(frozen=True, kw_only=True)
class CaseDraft:
    """Draft of a first case, usually without load and sweep.

    Parameters
    ----------
    text
        Tables from ``[structure]`` on, with explanatory comments.
    notes
        Sentences for the user, such as a list of faces.
    pictures
        Files of pictures.
    is_whole
        Whether the tables include loads and sweep.
    """

    text: str
    notes: tuple[str, ...] = ()
    pictures: tuple[Path, ...] = ()
    is_whole: bool = False


Drafter = Callable[[NewCaseRequest, RunContext], CaseDraft]


def key(name: str, marked: Marked, comment: str = "") -> str:
    """Format a line with a quantity or a word, and a comment with the reason if it was assumed."""
    value = str(marked.value)
    written = value if value.replace(".", "", 1).isdigit() else f'"{value}"'
    remarks = [item for item in (comment, f"assumed: {marked.assumed}" if marked.assumed else "") if item]
    return f"{name} = {written}" + (f" # {'; '.join(remarks)}" if remarks else "")


STEEL = """\
[structure.material] # steel
young = "210 GPa"
poisson = 0.3
density = "7800 kg/m^3"
"""
REDUCTION = """\
# Vibration shapes that are kept beside the points and lines that joints, loads and sensors use: as many as lie below
# three times the highest frequency of interest.
[structure.reduction]
modes = {modes}

[structure.damping]
ratio = "0.2 %" # of the first mode; a bare metal structure has 0.05 to 0.3 %
"""
