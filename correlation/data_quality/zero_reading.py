"""Single readings of exactly zero in a working channel: points that were not measured."""

from collections.abc import Iterator

import numpy as np

from correlation.campaign.measurement import CONTACT_FORCE, Campaign, Suspicion

#: Largest fraction of single zero readings of a channel [-]; a channel with more is dead in a part of its rows.
SINGLE = 0.1


def find_zero_readings(campaign: Campaign) -> Iterator[Suspicion]:
    """Fundamentals of motions that are exactly zero: noise alone gives more.

    Parameters
    ----------
    campaign
        Campaign; the force of a line may be zero in separation.
    """
    table = campaign.measurement
    for number, sensor in enumerate(campaign.sensors):
        own = (table.sensor == number) & (table.harmonic == 1)
        zero = own & (table.value == 0)
        if sensor.quantity == CONTACT_FORCE or not 0 < zero.sum() <= SINGLE * own.sum():
            continue
        first = int(np.flatnonzero(zero)[0])
        more = f" and at {zero.sum() - 1} more" if zero.sum() > 1 else ""
        yield Suspicion(
            where=f'test "{campaign.tests[int(table.test[first])].name}", sensor "{sensor.name}"',
            sentence=f"it reads exactly 0 at {table.level[first]:g} {campaign.drive.unit}, "
            f"{table.frequency[first]:g} Hz, repeat {table.repeat[first]}{more}: was it not measured "
            "there? Leave the value empty, and skip it",
        )
