"""Catalogue of the effects that may be missing from a model, and of those that cannot be tested with the reason."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeAlias

from correlation.campaign.measurement import Campaign
from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectError, Untestable
from diagnosis.candidate.scale import CONFIGURATIONS, measure_scale
from diagnosis.candidate.user_effect import list_checked, read_effects
from diagnosis.effect import EFFECTS, EffectKind, find_kind


class Source(Protocol):
    """Source of further effects, such as `diagnosis.candidate.user_effect.EffectSource`."""

    @property
    def candidates(self) -> Callable[[Model], Iterable[Effect | Untestable]]:
        """Effects for a model."""
        ...


#: Further effects: an effect, the path of a file that offers some, or another source.
Extra: TypeAlias = "Effect | Source | str | Path"


@dataclass(frozen=True, kw_only=True)
class Catalogue:
    """Candidates for one model.

    Parameters
    ----------
    candidates
        Effects that can be tested, with different names.
    untestable
        Effects that cannot be tested, with the reason.
    """

    candidates: tuple[Effect, ...]
    untestable: tuple[Untestable, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the candidates."""
        return tuple(item.name for item in self.candidates)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of the candidates, without repetition."""
        return tuple(dict.fromkeys(item.kind for item in self.candidates))

    def effect(self, name: str) -> Effect:
        """A candidate by its name.

        Raises
        ------
        EffectError
            There is no effect of this name, or it cannot be tested.
        """
        for item in self.candidates:
            if item.name == name:
                return item
        for left in self.untestable:
            if left.name == name:
                raise EffectError(f'"{name}" cannot be tested: {left.reason}')
        raise EffectError(f'there is no effect "{name}": there are {", ".join(self.names) or "none"}')

    def alike(self, effect: Effect) -> Effect:
        """The candidate that corresponds to an effect on another mesh: by name, or by the rule of its kind.

        Raises
        ------
        EffectError
            There is no such effect.
        """
        kind = find_kind(effect)
        is_alike = None if kind is None else kind.is_alike
        result = (item for item in self.candidates if is_alike is not None and is_alike(item, effect))
        return next(result, None) or self.effect(effect.name)


def list_kinds() -> list[EffectKind]:
    """All kinds of effects, in the order of the catalogue."""
    return sorted(EFFECTS, key=lambda kind: (kind.order, kind.name))


def list_effects(
    model: Model,
    *,
    without: Collection[str] = (),
    extra: Sequence[Extra] = (),
    level: float = 1.0,
    configurations: Collection[str] | Mapping[str, float] = CONFIGURATIONS,
) -> Catalogue:
    """All candidates for a model.

    Parameters
    ----------
    model
        Model with its places, parts, lines and sensors.
    without
        Kinds to leave out, such as "cubic".
    extra
        User effects: effects, paths of files that define some, or other sources.
    level
        Highest force of the tests, at which typical strengths of nonlinear effects are computed [N].
    configurations
        Tested configurations: "jointed", and "free" without the contacts of the lines; or the highest force of each.

    Raises
    ------
    EffectError
        The structure is not supported, a kind is unknown, two effects have one name, or a file offers no effects.
    """
    without = {without} if isinstance(without, str) else set(without)
    more = [item for source in extra for item in _from(source, model)]
    kinds = list_kinds()
    known = [
        *(kind.name for kind in kinds),
        *dict.fromkeys(item.kind for item in more if not isinstance(item, Untestable)),
    ]
    for kind in sorted(without):
        if kind not in known:
            raise EffectError(f'"{kind}" is not a kind of effect: leave out any of {", ".join(known)}')
    size = measure_scale(model, level=level, configurations=configurations)
    listed = [item for kind in kinds if kind.name not in without for item in list_checked(kind, model, size)]
    listed += [item for item in more if isinstance(item, Untestable) or item.kind not in without]
    names: set[str] = set()
    for item in listed:
        if item.name in names:
            raise EffectError(f'two effects are called "{item.name}": give each its own name')
        names.add(item.name)
    return Catalogue(
        candidates=tuple(item for item in listed if not isinstance(item, Untestable)),
        untestable=tuple(item for item in listed if isinstance(item, Untestable)),
    )


def list_campaign_effects(
    campaign: Campaign, model: Model, *, without: Collection[str] = (), extra: Sequence[Extra] = ()
) -> Catalogue:
    """All candidates for a model, with typical strengths for the tests of a campaign.

    Parameters
    ----------
    campaign
        Campaign; typical strengths are for the highest level of each tested configuration. With time records alone:
        1 N on the jointed structure.
    model, without, extra
        As for `list_effects`.
    """
    return list_effects(
        model,
        without=without,
        extra=extra,
        level=float(max(campaign.levels, default=1.0)),
        configurations=_find_highest_forces(campaign) or {"jointed"},
    )


def _find_highest_forces(campaign: Campaign) -> dict[str, float]:
    """Highest force of each tested configuration [N]."""
    table, result = campaign.measurement, dict[str, float]()
    for number, test in enumerate(campaign.tests):
        level = table.level[table.test == number].max(initial=0.0)
        result[test.configuration] = max(result.get(test.configuration, 0.0), float(level))
    return {configuration: level for configuration, level in result.items() if level > 0}


def _from(extra: Extra, model: Model) -> Iterable[Effect | Untestable]:
    if isinstance(extra, str | Path):
        return read_effects(extra).candidates(model)
    offered = getattr(extra, "candidates", None)
    if offered is not None:
        result: Iterable[Effect | Untestable] = offered(model)
        return result
    if not hasattr(extra, "apply"):
        raise EffectError(f"{extra!r} is not an effect: give effects, or paths of effect files")
    return [extra]  # type: ignore[list-item]
