"""Suspicious data of a campaign, and data missing for a study: reported before any conclusion."""

from collections.abc import Collection, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.manifest import MANIFEST
from correlation.campaign.measurement import Campaign, Suspicion, advise_held_out
from correlation.data_quality.conjugate import find_conjugate_tests
from correlation.data_quality.constant_factor import find_constant_factors
from correlation.data_quality.jump import find_jump_suspicions
from correlation.data_quality.model import find_model_suspicions, find_swapped_sensors
from correlation.data_quality.response import find_response_suspicions
from correlation.data_quality.swapped_force import find_swapped_forces
from correlation.data_quality.wrong_unit import LEVEL_UNITS, find_wrong_units
from correlation.errors import CampaignError
from correlation.feature.curve import list_curves
from correlation.feature.reading_noise import LEAST_REPEATED
from correlation.feature.table import average_campaign
from correlation.model import Model
from correlation.noise.smoothness import FEWEST
from correlation.prediction import Points, Prediction, Predictor
from study.compare.gross_misfit import GROSS, ROUGH_TOLERANCE, MotionReadings, find_motions
from study.compare.visible_resonance import find_visible_resonances
from study.compare.wrong_stiffness import find_wrong_stiffness

#: Number of readings to detect a wrong level.
MOST_ASKED = 60
#: Largest remaining misfit with the correct level (median of the natural logarithm) [-].
MENDED = 0.2
#: Number of lowest resonances within the scope of a test, of the stuck and of the free structure.
N_MODE = 3


def find_all_suspicions(campaign: Campaign, model: Model, before: Prediction | None = None) -> tuple[Suspicion, ...]:
    """Find all suspicions about a campaign.

    Parameters
    ----------
    campaign
        Measured campaign.
    model
        Model with the campaign's sensors.
    before
        States to start from, if any.
    """
    of_data = (*find_response_suspicions(model, campaign.data), *_suspect_kept_joints(campaign, model))
    if not len(campaign.measurement):
        return (*campaign.suspicions, *of_data)
    table = average_campaign(campaign)
    names = np.array([sensor.name for sensor in campaign.sensors])
    free = campaign.is_free
    points = Points(
        free=free[table.test],
        level=table.level,
        frequency=table.frequency,
        sensor=names[table.sensor],
        harmonic=table.harmonic,
    )
    predictor = Predictor(points=points, tolerance=ROUGH_TOLERANCE)
    predicted = predictor.predict(model).value if before is None else predictor.vary(model, before)
    all_readings = MotionReadings(points=points, value=table.value, stated=predicted)
    motions = all_readings.where(find_motions(campaign, points))
    of_tests = (
        *find_model_suspicions(campaign, compute_model_frequencies(model)),
        *find_conjugate_tests(campaign, table, predicted),
        *find_wrong_units(campaign, points, predicted),
    )
    if not any(suspicion.of_test for suspicion in (*campaign.suspicions, *of_tests)):
        of_tests = _suspect_levels(campaign, motions, model) or of_tests
        of_tests = (*of_tests, *find_constant_factors(campaign, points, predicted))
    of_case: tuple[Suspicion, ...] = ()
    if not any(suspicion.of_test for suspicion in (*campaign.suspicions, *of_tests)):
        of_case = find_wrong_stiffness(motions, model)
    swapped: tuple[Suspicion, ...] = ()
    if not of_case and not any(suspicion.of_test for suspicion in (*campaign.suspicions, *of_tests)):
        swapped = (*find_swapped_sensors(campaign, table, predicted), *find_swapped_forces(campaign, table, predicted))
    return (
        *campaign.suspicions,
        *of_tests,
        *of_case,
        *_suspect_single_repeat(campaign),
        *find_jump_suspicions(campaign),
        *{suspicion.where: suspicion for suspicion in reversed(swapped)}.values(),  # each pair once
        *of_data,
    )


def _suspect_kept_joints(campaign: Campaign, model: Model) -> Iterator[Suspicion]:
    """Joints that remain in the model although the structure was measured without contacts."""
    free = [item.name for item in (*campaign.tests, *campaign.data) if getattr(item, "configuration", "") == "free"]
    kept = [joint.name for joint in model.without_contacts().system.joints] if free else []
    if kept:
        yield Suspicion(
            where=f'"{free[0]}"', remark=True,
            headline=f"it keeps {', '.join(kept)} in the free structure ({', '.join(dict.fromkeys(free))})",
            sentence=(
                "is of the free structure, in which the model keeps joints that are not contact lines "
                f"({', '.join(kept)}): if it was measured without these, compare it with a case that has no such joints"
            ),
        )  # fmt: skip


def _suspect_levels(campaign: Campaign, motions: MotionReadings, model: Model) -> tuple[Suspicion, ...]:
    """Levels in a wrong unit, found by predictions at levels 1000 times smaller and larger."""
    readings = motions.some(MOST_ASKED)
    stated = readings.stated_misfit
    if not len(readings.value) or not stated > GROSS or campaign.drive.unit not in LEVEL_UNITS:
        return ()
    result = []
    for power in (-3, 3):
        level = readings.points.level * 10.0**power
        asked = replace(readings.points, level=level, force=level)
        left = readings.misfit(Predictor(points=asked, tolerance=ROUGH_TOLERANCE).predict(model).value)
        if left < MENDED:
            result.append(
                Suspicion(
                    where="levels",
                    sentence=f"with levels {10.0**power:g} times as large as stated the model agrees within "
                    f"{np.expm1(left):.1%}, and as stated it is off by a factor of "
                    f"{np.exp(stated):.3g} (medians): correct units.level of the manifest",
                    of_test=True,
                )
            )
    return tuple(result)


def compute_model_frequencies(model: Model) -> Float[NDArray[np.float64], " m"]:
    """Lowest resonances that a test can show: with stuck contacts, and without the contacts of lines [Hz]."""
    return np.concatenate([find_visible_resonances(item)[:N_MODE] for item in (model, model.without_contacts())])


def require_testable(campaign: Campaign, folder: Path) -> None:
    """Refuse a campaign without held-out data or with unknown noise, and list all missing data.

    Raises
    ------
    CampaignError
        Nothing is held out, or it has one repeat alone and no stated noise.
    """
    lacking = []
    if not (campaign.held_out.levels or campaign.held_out.repeats):
        advice = advise_held_out(campaign.measurement, campaign.level_factor)
        lacking.append(
            "nothing is held out, so neither a fit nor an effect can be tested: "
            + (
                f"name a level or a repeat under [held_out], e.g. {advice}"
                if advice
                else "measure another level or repeat, and name it under [held_out]"
            )
        )
    if single := _describe_single_repeat(campaign):
        lacking.append(single)
    if lacking:
        raise CampaignError(f"{folder / MANIFEST}: {'; and '.join(lacking)}")


def require_noise(campaign: Campaign, folder: Path) -> None:
    """Refuse a campaign without repeats, stated noise, or curves from which to estimate the noise.

    Raises
    ------
    CampaignError
        It has one repeat of few frequencies.
    """
    if all(any(sensor.noise) for sensor in campaign.sensors):
        return
    shown = any(len(curves.frequency) >= FEWEST for curves in list_curves(campaign))
    if not shown and (single := _describe_single_repeat(campaign)):
        raise CampaignError(f"{folder / MANIFEST}: {single}")


def _suspect_single_repeat(campaign: Campaign) -> Iterator[Suspicion]:
    """Suspicion about a campaign with a single repeat."""
    count = np.unique(campaign.measurement.repeat, return_counts=True)[1]
    if not len(count) or count.sum() - count.max() >= LEAST_REPEATED * count.max():
        return
    stated = all(any(sensor.noise) for sensor in campaign.sensors)
    source = "the manifest" if stated else "the residual of each curve from its smooth course"
    yield Suspicion(
        where="campaign",
        sentence=(
            f"there is one repeat: noise is taken from {source}, and the scatter between runs or assemblies is "
            "assumed: 0.03 % of frequencies and 1 % of preloads; repeat at least one level"
        ),
        remark=True,
    )


def require_parameters(parameters: Collection[Any], without: str = "nothing can be calibrated") -> None:
    """Refuse a case that has no parameters to fit.

    Parameters
    ----------
    parameters
        Parameters of the fit.
    without
        Consequence of having none, in words.

    Raises
    ------
    CampaignError
        There are none.
    """
    if not parameters:
        raise CampaignError(f"the case accepts no parameter, so that {without}: add [accepted]")


def _describe_single_repeat(campaign: Campaign) -> str:
    """Why the noise of a campaign of one repeat is unknown, and the remedy; empty if it is known."""
    repeats = np.unique(campaign.measurement.repeat)
    if len(repeats) > 1 or all(any(sensor.noise) for sensor in campaign.sensors):
        return ""
    return (
        f"all data have repeat = {repeats[0]}: noise cannot be separated from effects; measure the same once more, and "
        "number it by repeat of the [[run]] or the column repeat, or state the noise of sensors, as "
        'noise = "1 %" of a [[sensor]]'
    )
