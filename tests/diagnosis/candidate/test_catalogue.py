"""The catalogue: all kinds, each name once, what is left out and what is brought along."""

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from correlation.model import Model
from diagnosis.candidate.catalogue import Catalogue, campaign_catalogue, catalogue
from diagnosis.candidate.effect import EffectError, Untestable
from diagnosis.effect import EFFECTS
from diagnosis.effect.density import Density

OWN = Path(__file__).parents[3] / "examples" / "effects" / "exciter_third_harmonic.py"


def test_all_kinds_are_offered_and_all_names_are_unique(bench: Model) -> None:
    found = catalogue(bench)
    assert set(found.kinds) == set(EFFECTS.names())
    names = [*found.names, *(each.name for each in found.untestable)]
    assert len(names) == len(set(names))
    assert all(each.reason for each in found.untestable)


def test_kinds_can_be_left_out(bench: Model) -> None:
    found = catalogue(bench, without=["cubic", "gap"])
    assert set(found.kinds) == set(EFFECTS.names()) - {"cubic", "gap"}
    assert not any(each.name.startswith(("cubic", "gap")) for each in found.untestable)
    assert catalogue(bench, without="cubic").kinds == catalogue(bench, without=["cubic"]).kinds


def test_an_unknown_kind_to_leave_out_is_refused(bench: Model) -> None:
    with pytest.raises(EffectError, match='"cubik" is no kind of effect: leave out any of spring, mass'):
        catalogue(bench, without=["cubik"])


def test_effects_of_ones_own_take_part(bench: Model) -> None:
    lighter = replace(Density(name="density of all", part="beam"), kind="lightness")
    found = catalogue(bench, extra=[OWN, lighter])
    assert found.kinds[-2:] == ("exciter distortion", "lightness")
    assert catalogue(bench, extra=[OWN, lighter], without=["lightness"]).kinds[-1] == "exciter distortion"
    assert catalogue(bench, extra=[str(OWN)]).effect("third harmonic of the exciter").kind == "exciter distortion"


def test_two_effects_of_one_name_are_refused(bench: Model) -> None:
    with pytest.raises(EffectError, match='two effects are called "density of beam"'):
        catalogue(bench, extra=[Density(name="density of beam", part="beam")])


def test_what_is_no_effect_is_refused(bench: Model) -> None:
    with pytest.raises(EffectError, match="3 is no effect: give effects, or paths"):
        catalogue(bench, extra=[3])  # type: ignore[list-item]


def test_what_a_source_cannot_test_is_listed(bench: Model) -> None:
    class Source:
        def candidates(self, model: Model) -> list[Untestable]:
            return [Untestable(name="root slip", reason=f"the model has {len(model.parts)} parts and no root")]

    assert catalogue(bench, extra=[Source()]).untestable[-1].reason == "the model has 2 parts and no root"


def test_an_effect_is_found_by_its_name(bench: Model) -> None:
    found = catalogue(bench)
    assert found.effect("mass at tip z").kind == "mass"
    with pytest.raises(EffectError, match='there is no effect "mass at the moon": there are spring at tip z'):
        found.effect("mass at the moon")
    with pytest.raises(EffectError, match='"mass at tip x" cannot be tested: it is the mass at "tip z"'):
        found.effect("mass at tip x")


def test_a_campaign_says_how_strong_effects_are(small: Model, paper: ModuleType) -> None:
    campaign = paper.make_campaign(small)
    found = campaign_catalogue(campaign, small, without=["gain"])
    # Both configurations are tested.
    assert typical(found) == typical(catalogue(small, without=["gain"], level=max(paper.LEVELS)))
    jointed = replace(campaign, tests=tuple(replace(test, configuration="jointed") for test in campaign.tests))
    expected = catalogue(small, level=max(paper.LEVELS), configurations=["jointed"])
    assert typical(campaign_catalogue(jointed, small)) == typical(expected)


def test_time_records_alone_say_nothing_of_levels(small: Model, paper: ModuleType) -> None:
    campaign = paper.make_campaign(small)
    table = campaign.measurement
    silent = replace(campaign, tests=(), measurement=table.where(table.level < 0))
    assert typical(campaign_catalogue(silent, small)) == typical(catalogue(small, configurations=["jointed"]))


def test_each_configuration_counts_with_its_own_highest_level(small: Model, paper: ModuleType) -> None:
    campaign = paper.make_campaign(small)
    table = campaign.measurement
    free = np.array([test.configuration == "free" for test in campaign.tests])[table.test]
    faint = replace(campaign, measurement=replace(table, level=np.where(free, 1e-3 * table.level, table.level)))
    level = float(table.level.max())
    expected = catalogue(small, configurations={"jointed": level, "free": 1e-3 * float(table.level[free].max())})
    assert typical(campaign_catalogue(faint, small)) == typical(expected)
    alone = catalogue(small, configurations={"free": 2e-3})
    assert typical(alone) == typical(catalogue(small, level=2e-3, configurations=["free"]))


def typical(found: Catalogue) -> dict[str, list[float]]:
    return {each.name: [parameter.typical for parameter in each.parameters] for each in found.candidates}
