"""Conversion of frequency responses of the free structure to steady states, for a diagnosis of the jointed structure.

A response to broadband excitation has no level. A linear structure has the same response at all levels: without
contacts, it is used at a level so small that the contribution of any effect is also linear.
"""

from dataclasses import replace

from correlation.campaign.measurement import Campaign, Test
from correlation.campaign.run_table import join_rows
from correlation.campaign.stepped_sine import find_sorting
from correlation.data_type.frequency_response import list_states
from correlation.data_type.measured_response import MeasuredResponse

#: Level of these states over the lowest of the campaign [-].
SMALL_LEVEL = 1e-3


def count_free_responses(campaign: Campaign) -> tuple[Campaign, tuple[str, ...]]:
    """Add the frequency responses of the free structure as steady states, and return the names of these responses.

    Responses are left out if they have a level, are held out, are changed by an exponential window or leakage, or have
    no mode; all are left out if the free structure has measured steady states, whose noise differs.

    Parameters
    ----------
    campaign
        Campaign with steady states of the jointed structure.
    """
    responses = [datum for datum in campaign.data if isinstance(datum, MeasuredResponse) and _is_linear(datum)]
    if not responses or campaign.is_free[campaign.measurement.test].any():
        return campaign, ()
    level, names = SMALL_LEVEL * float(campaign.levels[0]), [sensor.name for sensor in campaign.sensors]
    tests = (*campaign.tests, *(Test(name=response.name, configuration="free") for response in responses))
    numbered = enumerate(responses, start=len(campaign.tests))
    states = [list_states(replace(response, level=level, test=number), names) for number, response in numbered]
    measurement = join_rows([campaign.measurement, *(rows for rows in states if rows is not None)])
    counted = replace(campaign, tests=tests, measurement=measurement.where(find_sorting(measurement)))
    return counted, tuple(response.name for response in responses)


def _is_linear(response: MeasuredResponse) -> bool:
    of_free = response.configuration == "free" and response.level is None and not response.held_out
    return of_free and not response.decay and response.fit is not None and not response.fit.leaks
