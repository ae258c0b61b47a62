"""Kinds of effects, one a file: what may be missing from a model. `EFFECTS` finds them."""

from diagnosis.effect.registry import EFFECTS, EffectKind

__all__ = ["EFFECTS", "EffectKind"]
