"""Further tests of a structure joined to its campaign."""

from dataclasses import fields, replace
from typing import Any

import numpy as np

from correlation.campaign.measurement import Campaign, Measurement, Test
from correlation.errors import CampaignError


def join_campaigns(campaign: Campaign, further: Campaign) -> Campaign:
    """A campaign with the tests of another one after its own.

    Repeats of the further tests are other repeats: they are numbered after those of the campaign. Levels that the
    campaign holds out stay held out, and so do the repeats that either holds out.

    Parameters
    ----------
    campaign
        Campaign.
    further
        Further tests of the same structure under the same drive; sensors of equal names are the same ones.

    Raises
    ------
    CampaignError
        Another drive, or a sensor that measures something else in both.
    """
    if campaign.drive != further.drive:
        raise CampaignError(
            f"{further.folder}: drive = {further.drive.quantity} in {further.drive.unit} is another one than that of "
            f"{campaign.folder}: join tests under the same drive"
        )
    own = {each.name: each for each in campaign.sensors}
    for each in further.sensors:
        there = own.get(each.name)
        if there is not None and (there.quantity, there.place, there.line, there.component) != (
            each.quantity, each.place, each.line, each.component,
        ):  # fmt: skip
            raise CampaignError(
                f'{further.folder}: sensor "{each.name}" is not that of {campaign.folder}: give it another name'
            )
    sensors = (*campaign.sensors, *(each for each in further.sensors if each.name not in own))
    number = {each.name: place for place, each in enumerate(sensors)}
    names = {each.name for each in campaign.tests}
    tests = tuple(_rename(each, names) for each in further.tests)
    first, second = campaign.measurement, further.measurement
    last = int(first.repeat.max(initial=0))
    held_out = replace(
        campaign.held_out,
        repeats=(*campaign.held_out.repeats, *(repeat + last for repeat in further.held_out.repeats)),
    )
    moved = replace(
        second,
        test=second.test + len(campaign.tests),
        order=second.order + first.order.max(initial=-1) + 1,
        repeat=second.repeat + last,
        sensor=np.array([number[further.sensors[each].name] for each in second.sensor.tolist()], dtype=np.int64),
    )
    columns: dict[str, Any] = {
        each.name: np.concatenate([getattr(first, each.name), getattr(moved, each.name)])
        for each in fields(Measurement)
    }
    return replace(
        campaign, sensors=sensors, tests=(*campaign.tests, *tests), measurement=Measurement(**columns),
        records=(*campaign.records, *further.records), data=(*campaign.data, *further.data),
        suspicions=(*campaign.suspicions, *further.suspicions), held_out=held_out,
    )  # fmt: skip


def _rename(test: Test, names: set[str]) -> Test:
    """The test with a name of its own."""
    name, count = test.name, 2
    while name in names:
        name, count = f"{test.name} {count}", count + 1
    names.add(name)
    return replace(test, name=name)
