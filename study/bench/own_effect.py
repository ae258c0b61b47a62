"""Effect files of the user: shown by the page, and tried before they are saved.

An effect file is a program. It runs under the rule for all Python files that a case names (`study.case.trust`).
"""

import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from correlation.campaign.measurement import Campaign
from correlation.model import TRANSLATIONS, Model
from diagnosis.candidate.effect import EffectError, Untestable
from diagnosis.candidate.place import find_dof
from diagnosis.candidate.user_effect import read_effects
from geometry.errors import InputError
from study.bench.case_text import hash_text, list_effect_files, with_effect_files
from study.bench.copied_case import copy_beside, make_effect_folder, write_effect_copy
from study.case.added import list_case_effects
from study.case.setup import read_case
from study.case.trust import require_trust
from study.diagnose.history import read_text, write_beside
from study.kind.registry import open_case
from study.run_context import RunContext

#: Pattern of the name of a new file.
NAME = re.compile(r"[A-Za-z]\w*\.py", re.ASCII)
#: Stiffness at which the template is screened, and its upper bound, as fractions of the stiffness of its place [-].
TYPICAL, LARGEST = 0.01, 10.0
TEMPLATE = '''"""An effect of your own: describe it here."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter

PLACE = {place!r}
# The strength comes first, with the value at which it is screened; at 0 the effect changes nothing.
STIFFNESS = EffectParameter(name="stiffness", unit="N/m", lower=0.0, upper={largest:.3g}, typical={typical:.3g})


@dataclass(frozen=True)
class OwnSpring:
    name: str = f"own spring at {{PLACE}}"
    kind: str = "own spring"
    physics: str = "A spring connects the place to the ground."
    signature: str = "Resonance frequencies of modes that move the place rise by the same share at all levels."
    parameters: tuple[EffectParameter, ...] = (STIFFNESS,)

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        row = model.places[PLACE]
        return model.with_system(stiffness=model.system.stiffness + values[0] * np.outer(row, row))


def candidates(model: Model) -> list[Effect]:
    return [OwnSpring()] if PLACE in model.places else []
'''


@dataclass(frozen=True, kw_only=True)
class OwnFile:
    """An effect file of a case.

    Parameters
    ----------
    case
        Path of the case.
    name
        Name of the file in the user's case.
    is_copy
        Whether the case is a copy, with effect files in a separate folder.
    """

    case: Path
    name: str
    is_copy: bool = False

    @property
    def named(self) -> str:
        """Name of the file in the case or its copy."""
        return f"{make_effect_folder(self.case).name}/{self.name}" if self.is_copy else self.name

    @property
    def path(self) -> Path:
        """Path of the file."""
        return self.case.parent / self.named

    @property
    def text(self) -> str | None:
        """Text of the file; None if it does not exist.

        Raises
        ------
        EffectError
            The file cannot be read, or is not text.
        """
        try:
            return self.path.read_bytes().decode("utf-8") if self.path.is_file() else None
        except (OSError, UnicodeDecodeError) as error:
            raise EffectError(
                f"{self.path} cannot be read ({error}): change its permissions or save it as UTF-8"
            ) from None

    @property
    def hash(self) -> str:
        """Hash of the text; empty if the file does not exist."""
        return "" if self.text is None else hash_text(self.text)

    def write(self, text: str) -> None:
        """Write the file."""
        if self.is_copy:
            write_effect_copy(self.case, self.name, text)
        else:
            write_beside(self.path, text)


def show_own_effects(case: Path, model: Model) -> dict[str, Any]:
    """Make the view of the effect files that the case names, with a template for another; no file is run."""
    files = []
    for name in list_effect_files(read_text(case)):
        own = OwnFile(case=case, name=name)
        if not _lies_outside(name) and own.text is not None:
            files.append({"name": name, "text": own.text, "hash": own.hash})
    return {"files": files, "template": write_template(model)}


def write_template(model: Model) -> str:
    """Write the template of an effect file: a spring at the first place that is a displacement; empty without one."""
    for name, row in model.places.items():
        dof, stiffness = find_dof(model, row), float(row @ model.system.stiffness @ row)
        if stiffness > 0 and (dof is None or dof.direction in TRANSLATIONS):
            return TEMPLATE.format(place=name, typical=TYPICAL * stiffness, largest=LARGEST * stiffness)
    return ""


def save_own_effect(
    own: OwnFile, text: str, campaign: Campaign, run: RunContext
) -> tuple[dict[str, float | str], Model]:
    """Write an effect file and its name into the case, after a trial on a copy of the case.

    Parameters
    ----------
    own
        Effect file.
    text
        New text of the file.
    campaign
        Campaign whose sensors are added to the model.
    run
        Store of the structure.

    Returns
    -------
    Names of the offered effects, and the model without added effects.

    Raises
    ------
    EffectError
        The name of the file is invalid, or the file has a mistake, with its line; nothing is written then.
    UntrustedCode
        Other users may change the folder, and the user does not trust them.
    CaseError, OutputError
        The case cannot be read, edited or written.
    """
    open_case(own.case)
    before = read_text(own.case)
    files = list_effect_files(before)
    _require_name(own, text, files)
    require_trust([own.path], own.case)
    after = before if own.named in files else with_effect_files(before, [*files, own.named], str(own.case))
    tried = _try_effect(own, text, after, campaign, run)
    own.write(text)
    if after != before:
        write_beside(own.case, after)
    return tried


def _require_name(own: OwnFile, text: str, files: list[str]) -> None:
    if _lies_outside(own.name):
        raise EffectError(f'"{own.name}" is outside the folder of {own.case.name}: edit it there')
    if own.named in files:
        return
    if not NAME.fullmatch(own.name):
        raise EffectError(
            f'"{own.name}" is not a name of an effect file: give letters, digits and _, with .py at the end'
        )
    if own.text not in {None, text}:
        raise EffectError(
            f"{own.path} is there already, and {own.case.name} does not name it: give the effect file another name"
        )


def _lies_outside(name: str) -> bool:
    return PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts


def _try_effect(
    own: OwnFile, text: str, after: str, campaign: Campaign, run: RunContext
) -> tuple[dict[str, float | str], Model]:
    """Run the file on a copy of the case; messages name the user's files, not the copies."""
    with copy_beside(own.case, after, "", {own.named: text}) as copy:
        file = (make_effect_folder(copy) / own.named).resolve()
        try:
            setup = read_case(copy, campaign, run).setup
            offered = read_effects(file).candidates(setup.model)
            list_case_effects(setup.model, setup.effect_files)  # refuses duplicate names
        except InputError as error:
            sentence = str(error).replace(str(file), str(own.path)).replace(str(copy), str(own.case))
            raise EffectError(sentence) from None
    names = [item.name for item in offered if not isinstance(item, Untestable)]
    left = [f"{item.name}: {item.reason}" for item in offered if isinstance(item, Untestable)]
    answer: dict[str, float | str] = {"offers": ", ".join(names) or "no effect for this structure"}
    return answer | ({"cannot act here": "; ".join(left)} if left else {}), setup.model
