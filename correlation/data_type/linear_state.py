"""Frequency responses of a linear structure as steady states, for a diagnosis of the jointed one.

A response of broadband excitation belongs to no level. Where the structure is linear, each level has the same: free of
all contacts it counts at one that is so small that whatever an effect adds to it is linear, too.
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
    """The campaign with the frequency responses of its free structure as steady states, and their names.

    Left out are responses that count at a level of their own, that are held out, that an exponential window or leakage
    has changed, and that show no mode; all of them where the free structure has steady states of its own, whose noise
    is another.

    Parameters
    ----------
    campaign
        With steady states of the jointed structure.
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
