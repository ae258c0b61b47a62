"""The catalogue: all kinds, each name once, what is left out and what is brought along."""

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from correlation.model import Model
from diagnosis.candidate.catalogue import Catalogue, list_campaign_effects, list_effects
from diagnosis.candidate.effect import EffectError, Untestable
from diagnosis.effect import EFFECTS
from diagnosis.effect.density import Density

OWN = Path(__file__).parents[3] / "examples" / "effects" / "exciter_third_harmonic.py"


def offered(found: Catalogue) -> set[str]:
    """Kinds of a catalogue, with those that the bench has no place for."""
    return {*found.kinds, *(item.name for item in found.untestable if item.name in EFFECTS)}


def test_all_kinds_are_offered_and_all_names_are_unique(bench: Model) -> None:
    result = list_effects(bench)
    assert offered(result) == set(EFFECTS.names())
    names = [*result.names, *(item.name for item in result.untestable)]
    assert len(names) == len(set(names))
    assert all(item.reason for item in result.untestable)


def test_kinds_can_be_left_out(bench: Model) -> None:
    result = list_effects(bench, without=["cubic", "gap"])
    assert offered(result) == set(EFFECTS.names()) - {"cubic", "gap"}
    assert not any(item.name.startswith(("cubic", "gap")) for item in result.untestable)
    assert list_effects(bench, without="cubic").kinds == list_effects(bench, without=["cubic"]).kinds


def test_an_unknown_kind_to_leave_out_is_refused(bench: Model) -> None:
    with pytest.raises(EffectError, match='"cubik" is not a kind of effect: leave out any of spring, mass'):
        list_effects(bench, without=["cubik"])


def test_effects_of_ones_own_take_part(bench: Model) -> None:
    lighter = replace(Density(name="density of all", part="beam"), kind="lightness")
    result = list_effects(bench, extra=[OWN, lighter])
    assert result.kinds[-2:] == ("exciter distortion", "lightness")
    assert list_effects(bench, extra=[OWN, lighter], without=["lightness"]).kinds[-1] == "exciter distortion"
    assert list_effects(bench, extra=[str(OWN)]).effect("third harmonic of the exciter").kind == "exciter distortion"


def test_two_effects_of_one_name_are_refused(bench: Model) -> None:
    with pytest.raises(EffectError, match='two effects are called "density of beam"'):
        list_effects(bench, extra=[Density(name="density of beam", part="beam")])


def test_what_is_no_effect_is_refused(bench: Model) -> None:
    with pytest.raises(EffectError, match="3 is not an effect: give effects, or paths"):
        list_effects(bench, extra=[3])  # type: ignore[list-item]


def test_what_a_source_cannot_test_is_listed(bench: Model) -> None:
    class Source:
        def candidates(self, model: Model) -> list[Untestable]:
            return [Untestable(name="root slip", reason=f"the model has {len(model.parts)} parts and no root")]

    assert list_effects(bench, extra=[Source()]).untestable[-1].reason == "the model has 2 parts and no root"


def test_an_effect_is_found_by_its_name(bench: Model) -> None:
    result = list_effects(bench)
    assert result.effect("mass at tip z").kind == "mass"
    with pytest.raises(EffectError, match='there is no effect "mass at the moon": there are spring at tip z'):
        result.effect("mass at the moon")
    with pytest.raises(EffectError, match='"mass at tip x" cannot be tested: it is the mass at "tip z"'):
        result.effect("mass at tip x")


def test_a_campaign_says_how_strong_effects_are(small: Model, paper: ModuleType) -> None:
    campaign = paper.make_campaign(small)
    result = list_campaign_effects(campaign, small, without=["gain"])
    # Both configurations are tested.
    assert typical(result) == typical(list_effects(small, without=["gain"], level=max(paper.LEVELS)))
    jointed = replace(campaign, tests=tuple(replace(test, configuration="jointed") for test in campaign.tests))
    expected = list_effects(small, level=max(paper.LEVELS), configurations=["jointed"])
    assert typical(list_campaign_effects(jointed, small)) == typical(expected)


def test_time_records_alone_say_nothing_of_levels(small: Model, paper: ModuleType) -> None:
    campaign = paper.make_campaign(small)
    table = campaign.measurement
    silent = replace(campaign, tests=(), measurement=table.where(table.level < 0))
    assert typical(list_campaign_effects(silent, small)) == typical(list_effects(small, configurations=["jointed"]))


def test_each_configuration_counts_with_its_own_highest_level(small: Model, paper: ModuleType) -> None:
    campaign = paper.make_campaign(small)
    table = campaign.measurement
    free = np.array([test.configuration == "free" for test in campaign.tests])[table.test]
    faint = replace(campaign, measurement=replace(table, level=np.where(free, 1e-3 * table.level, table.level)))
    level = float(table.level.max())
    expected = list_effects(small, configurations={"jointed": level, "free": 1e-3 * float(table.level[free].max())})
    assert typical(list_campaign_effects(faint, small)) == typical(expected)
    alone = list_effects(small, configurations={"free": 2e-3})
    assert typical(alone) == typical(list_effects(small, level=2e-3, configurations=["free"]))


def typical(found: Catalogue) -> dict[str, list[float]]:
    return {item.name: [parameter.typical for parameter in item.parameters] for item in found.candidates}
