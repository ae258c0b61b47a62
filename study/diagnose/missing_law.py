"""The recovered law of a residual that no known effect explains: its words, numbers and effect file."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.fit.arrangement import Arrangement
from diagnosis.missing_law.curves import CurveWithBand, LawCurves, compute_curves
from diagnosis.missing_law.description import LawDescription, describe
from diagnosis.missing_law.effect_file import write_effect_file
from diagnosis.missing_law.place_law import MissingLaw
from diagnosis.missing_law.recover import recover_law
from diagnosis.resonator import Resonator


@dataclass(frozen=True, kw_only=True, eq=False)
class RecoveredLaw:
    """A law with its curves and words.

    Parameters
    ----------
    law, curves, words
        Law at each place, and curves and words of the most probable law.
    """

    law: MissingLaw
    curves: LawCurves
    words: LawDescription

    @property
    def name(self) -> str:
        """Name of its effect."""
        return f"recovered law at {self.law.best.name}"

    @property
    def sentences(self) -> list[str]:
        """Place and behaviour of the law."""
        probability = f"{100 * self.law.probability[0]:.0f} %"
        where = f"A law at {self.law.best.name} ({probability}) explains most of the difference"
        if len(self.law.credible) > 1:
            where += f"; the places {', '.join(self.law.credible)} have a probability of 95 % together"
        return [f"{where}.", *(f"{item[0].upper()}{item[1:]}." for item in self.words.sentences)]

    @property
    def effect_file(self) -> str:
        """Text of a file with the law as an effect."""
        return write_effect_file(self.law.best, self.curves, self.words)

    @property
    def document(self) -> dict[str, Any]:
        """For JSON."""
        curves = self.curves
        motion, speed, force, stiffness = (_make_key(unit) for unit in curves.units[:4])
        return {
            "places": {
                place.name: {"probability": float(chance), "evidence": float(place.evidence)}
                for place, chance in zip(self.law.places, self.law.probability, strict=True)
            },
            "credible": [*self.law.credible],
            "words": [*self.words.words],
            "sentences": self.sentences,
            "sees_even": curves.sees_even,
            "spring": _document_curve(curves.spring, f"displacement_{motion}", f"force_{force}"),
            "damper": _document_curve(curves.damper, f"velocity_{speed}", f"force_{force}"),
            "secant_stiffness": _document_curve(curves.stiffness, f"amplitude_{motion}", f"stiffness_{stiffness}"),
            "work_per_cycle": _document_curve(curves.work, f"amplitude_{motion}", "work_j"),
        }


def find_missing_law(arrangement: Arrangement, verdict: Verdict) -> MissingLaw | None:
    """The law, if no known effect explains the residual; a resonator has no law."""
    if verdict.finding is not Finding.UNKNOWN or isinstance(verdict.place, Resonator):
        return None
    return recover_law(arrangement)


def describe_law(law: MissingLaw | None) -> RecoveredLaw | None:
    """The law with its curves and words, if there is one."""
    if law is None:
        return None
    curves = compute_curves(law.best)
    return RecoveredLaw(law=law, curves=curves, words=describe(curves))


def format_law(law: RecoveredLaw | None, file: str) -> Iterator[str]:
    """Lines of the report."""
    if law is None:
        return
    yield ""
    yield "The missing force law, recovered without the catalogue of effects:"
    yield from (f"  {sentence}" for sentence in law.sentences)
    yield f'  as an effect: name {file} in [effects] files of the case; stickslip add "{law.name}" --value 1 adds it'


def _make_key(unit: str) -> str:
    """A unit as part of a key: "n_per_m"."""
    return unit.lower().replace("/", "_per_").replace(" ", "_")


def _document_curve(curve: CurveWithBand, x: str, y: str) -> dict[str, Any]:
    return {x: curve.x, y: curve.mean, "low_95": curve.low, "high_95": curve.high}
