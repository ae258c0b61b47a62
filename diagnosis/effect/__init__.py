"""Kinds of effects that may be missing from a model, one per file; `EFFECTS` finds them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from correlation.model import Model
from diagnosis.candidate.effect import Effect, Untestable
from diagnosis.candidate.force_law import ForceLaw
from diagnosis.candidate.scale import Scale
from geometry.registry import Registry
from hbsolve.state import SteadyState

__all__ = ["EFFECTS", "EffectKind", "OtherLaws", "find_kind"]

OtherLaws = Callable[[Effect, float, Model, Sequence[SteadyState]], Sequence[ForceLaw]]


@dataclass(frozen=True, kw_only=True, eq=False)
class EffectKind:
    """A kind of effect, at any place.

    Parameters
    ----------
    name
        The `kind` of its effects, such as "mass".
    acts_on
        Objects of a model on which it acts, in the plural, such as "places that move".
    physics, signature
        Physical cause, and signature in measurements, in a sentence each.
    parameters
        Units of its parameters by name, the strength first: one, or those for a displacement and for a rotation.
    candidates
        Function of a model and its scale: effects, and those that cannot be tested with the reason.
    order
        Rank in lists of all kinds: smaller first [-].
    acts_by_slip_alone
        Whether it acts through stick and slip alone, so that its derivative may have the wrong sign.
    has_two_sides
        Whether it is fitted from both sides of its neutral value, since chi^2 may have a minimum on either side.
    is_addition
        Whether it adds a part to the structure, so that a negative strength removes a part of the model.
    is_alike
        Function that decides whether effects of two meshes are the same; by their names by default.
    other_laws
        Function of an effect, its strength, the model with it, and the states: other laws that the force may have. None
        if none is known.
    """

    name: str
    acts_on: str
    physics: str
    signature: str
    parameters: Mapping[str, tuple[str, ...]]
    candidates: Callable[[Model, Scale | None], list[Effect | Untestable]]
    order: int = 100
    acts_by_slip_alone: bool = False
    has_two_sides: bool = False
    is_addition: bool = False
    is_alike: Callable[[Effect, Effect], bool] | None = None
    other_laws: OtherLaws | None = None


def _wrong(kind: EffectKind) -> str | None:
    for fact in ("acts_on", "physics", "signature"):
        if not isinstance(getattr(kind, fact), str) or not getattr(kind, fact).strip():
            return f"has {fact} = {getattr(kind, fact)!r}: say it in words"
    if not isinstance(kind.parameters, Mapping) or not kind.parameters:
        return f'has parameters = {kind.parameters!r}: name each with its units, such as {{"mass": ("kg",)}}'
    return None if callable(kind.candidates) else f"has candidates = {kind.candidates!r}: give a function of a model"


EFFECTS: Registry[EffectKind] = Registry(
    "kind of effect",
    package="diagnosis.effect",
    group="stickslip.effects",
    facts={
        "acts_on": "what of a model it acts on",
        "physics": "the cause in a sentence",
        "signature": "how it shows in measurements",
        "parameters": "its numbers with their units",
        "candidates": "a function that lists its effects on a model",
    },
    check=_wrong,
)


def find_kind(effect: Effect) -> EffectKind | None:
    """Registered kind of an effect; None for a user effect without a kind."""
    if effect.kind not in EFFECTS:
        return None
    return EFFECTS[effect.kind]
