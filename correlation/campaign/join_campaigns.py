"""Join a campaign with further tests of the same structure."""

from dataclasses import fields, replace
from typing import Any

import numpy as np

from correlation.campaign.measurement import Campaign, Measurement, Test
from correlation.errors import CampaignError


def join_campaigns(campaign: Campaign, further: Campaign) -> Campaign:
    """Append the tests of a further campaign to a campaign.

    The repeats of the further tests are numbered after those of the campaign. The levels that the first campaign holds
    out and the repeats that either campaign holds out stay held out.

    Parameters
    ----------
    campaign
        Campaign.
    further
        Further tests of the same structure under the same drive; sensors of equal names are the same sensor.

    Raises
    ------
    CampaignError
        The drives differ, or sensors of one name measure different quantities or places.
    """
    if campaign.drive != further.drive:
        raise CampaignError(
            f"{further.folder}: drive = {further.drive.quantity} in {further.drive.unit} differs from that of "
            f"{campaign.folder}: join tests under the same drive"
        )
    own = {item.name: item for item in campaign.sensors}
    for item in further.sensors:
        there = own.get(item.name)
        if there is not None and (there.quantity, there.place, there.line, there.component) != (
            item.quantity, item.place, item.line, item.component,
        ):  # fmt: skip
            raise CampaignError(
                f'{further.folder}: sensor "{item.name}" differs from that of {campaign.folder}: give it another name'
            )
    sensors = (*campaign.sensors, *(item for item in further.sensors if item.name not in own))
    number = {item.name: place for place, item in enumerate(sensors)}
    names = {item.name for item in campaign.tests}
    tests = tuple(_rename(item, names) for item in further.tests)
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
        sensor=np.array([number[further.sensors[item].name] for item in second.sensor.tolist()], dtype=np.int64),
    )
    columns: dict[str, Any] = {
        item.name: np.concatenate([getattr(first, item.name), getattr(moved, item.name)])
        for item in fields(Measurement)
    }
    return replace(
        campaign, sensors=sensors, tests=(*campaign.tests, *tests), measurement=Measurement(**columns),
        records=(*campaign.records, *further.records), data=(*campaign.data, *further.data),
        suspicions=(*campaign.suspicions, *further.suspicions), held_out=held_out,
    )  # fmt: skip


def _rename(test: Test, names: set[str]) -> Test:
    """Number the name of a test if another test has it already."""
    name, count = test.name, 2
    while name in names:
        name, count = f"{test.name} {count}", count + 1
    names.add(name)
    return replace(test, name=name)
