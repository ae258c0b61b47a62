"""If no effect is visible in the measurements: the further test that shows most effects of typical strength."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from correlation.campaign.measurement import Campaign
from correlation.noise.error_size import NO_ERROR
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import EffectError
from diagnosis.fit.arrangement import Arrangement
from diagnosis.next_test.advise import find_error_sources, find_peak
from diagnosis.next_test.list_tests import Tested, list_tests
from diagnosis.next_test.next_test import NextTest
from diagnosis.next_test.plan import plan_tests
from diagnosis.next_test.signature import ErrorSources, SetUpEffect
from hbsolve.errors import ModelError


@dataclass(frozen=True, kw_only=True, eq=False)
class VisibleTest:
    """A test with the effects that are visible in it.

    Parameters
    ----------
    test
        Test.
    seen
        Names of the effects that would be named at their typical strength.
    n_effect
        Number of effects [-].
    """

    test: NextTest
    seen: tuple[str, ...]
    n_effect: int


def find_visible_test(campaign: Campaign, arrangement: Arrangement, catalogue: Catalogue) -> VisibleTest | None:
    """Find the test that shows most effects; among equal ones the shortest.

    Further sensors are tried in the best test without one, or in all tests if none without one shows an effect: each
    sensor takes as much computing time as a test.

    Parameters
    ----------
    campaign
        Present measurements.
    arrangement
        Arrangement of these measurements.
    catalogue
        Effects.

    Returns
    -------
    The test; None if no test shows an effect.
    """
    tested = Tested.of_campaign(campaign, arrangement.train.predictor.sweeps)
    listed = list_tests(tested, arrangement.fit.model, find_peak(arrangement, tested))
    tests = [item for item in listed if item.fits_campaign]
    sources = find_error_sources(campaign, arrangement, NO_ERROR)

    def choose(some: Sequence[NextTest]) -> VisibleTest | None:
        seen = [_predict_visible_effects(item, arrangement, catalogue, sources) for item in some]
        best = min(seen, key=lambda item: (-len(item.seen), item.test.minutes), default=None)
        return best if best is not None and best.seen else None

    bare = choose([item for item in tests if item.place is None])
    names = {bare.test.name} if bare is not None else {item.name for item in tests}
    sensor = choose([item for item in tests if item.place is not None and item.name in names])
    if bare is None or sensor is None:
        return bare or sensor
    return sensor if len(sensor.seen) > len(bare.seen) else bare


def _predict_visible_effects(
    test: NextTest, arrangement: Arrangement, catalogue: Catalogue, sources: ErrorSources
) -> VisibleTest:
    """Effects that are visible in a test; none if the model has no state in it."""
    places = () if test.place is None else (test.place,)
    model = SetUpEffect(set_up=test.set_up, places=places, quantity=sources.quantity).apply(arrangement.fit.model, ())
    names: tuple[str, ...] = ()
    try:
        plan = plan_tests(
            [test], model, arrangement.calibration, replace(sources.budget, refined=()), sources.noise, catalogue
        )
        names = tuple(score.effect.name for score in plan.seen if plan.relative(score) <= 1)
    except (EffectError, ModelError):
        pass
    return VisibleTest(test=test, seen=names, n_effect=len(catalogue.candidates))
