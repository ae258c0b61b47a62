"""Plan of the hidden-effect test: its campaigns, and the catalogue names of the effects that the bench plants."""

from collections.abc import Collection
from dataclasses import dataclass

from correlation.model import Model
from transient.virtual_bench.effect import NOTHING
from transient.virtual_bench.hidden_effect import HiddenEffectRecord

#: Kind of an effect on the bench to its kind in the catalogue.
KIND = {
    "mass": "mass",
    "spring": "spring",
    "cubic": "cubic",
    "air_damping": "air damping",
    "gap": "gap",
    "preload": "preload",
    "friction": "friction coefficient",
}
#: Rows of the score: planted kind, and whether the catalogue lacks it. A stop is never in the catalogue.
ROWS: dict[str, tuple[str, bool]] = {
    **{kind: (kind, False) for kind in KIND},
    NOTHING: (NOTHING, False),
    "cubic_excluded": ("cubic", True),
    "air_damping_excluded": ("air_damping", True),
    "stop": ("stop", True),
}
PLANTED = tuple(KIND)
EXCLUDED = tuple(row for row, (_, excluded) in ROWS.items() if excluded)
#: Distance between the first seeds of two rows, so that no two campaigns have the same specimen.
APART = 1000


@dataclass(frozen=True, kw_only=True)
class Case:
    """Row of the score and seed of one campaign."""

    row: str
    seed: int

    @property
    def kind(self) -> str:
        """Kind that the bench plants."""
        return ROWS[self.row][0]

    @property
    def excluded(self) -> bool:
        """Whether the catalogue lacks the kind."""
        return ROWS[self.row][1]


def cases(n_seed: int, n_nothing: int, first_seed: int, only: Collection[str] = ()) -> list[Case]:
    """List all campaigns with interleaved rows, so that the first part of the list is balanced.

    Parameters
    ----------
    n_seed, n_nothing
        Number of seeds of a row with an effect, and of the row without any; at most `APART`.
    first_seed
        First seed of the first row.
    only
        Rows to run; all by default.
    """
    if max(n_seed, n_nothing) > APART:
        raise SystemExit(f"{max(n_seed, n_nothing)} seeds a row overlap with the next row: at most {APART}")
    listed = []
    for number, row in enumerate(ROWS):
        n = n_nothing if row == NOTHING else n_seed
        if not only or row in only:
            first = first_seed + APART * number
            listed += [((i + 0.5) / n, number, Case(row=row, seed=first + i)) for i in range(n)]
    return [case for *_, case in sorted(listed, key=lambda item: item[:2])]


def effect_name(truth: HiddenEffectRecord, base: Model) -> str:
    """Name of a planted effect in the catalogue; "" for no effect and for one that the catalogue never has."""
    kind, place = truth.effect.kind, truth.effect.place
    match kind:
        case "mass" | "spring" | "cubic" | "air_damping":
            return f"{KIND[kind]} at {place}"
        case "gap":
            return f"gap of {place} at {base.lines[place][-1]}"
        case "preload":
            return f"preload of {place}"
        case "friction":
            left, right = base.lines
            return f"friction coefficient of {left} against {right}"
        case _:
            return ""


def effect_value(truth: HiddenEffectRecord) -> float:
    """True value of the parameter of a planted effect, relative to the specimen's own calibration parameters."""
    side = 0 if truth.effect.place == "left" else 1
    match truth.effect.kind:
        case "preload":
            return 1 + truth.effect.strength / truth.parameters.preload[side]
        case "friction":
            left, right = truth.parameters.friction_coefficient
            added = truth.effect.strength
            return (left + added) / right if side == 0 else left / (right + added)
        case _:
            return truth.effect.strength
