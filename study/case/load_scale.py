"""Check of the load amplitude of a case against the levels of a campaign."""

from collections.abc import Sequence

from correlation.campaign.measurement import Drive
from study.case.load_table import LoadTable

#: Key of a load with an amplitude of 1, by the quantity of the levels of a campaign.
UNIT_AMPLITUDE = {"force": 'amplitude = "1 N"', "base acceleration": 'acceleration = "1 m/s^2"'}


def find_scale_warning(loads: Sequence[LoadTable], drive: Drive) -> str | None:
    """Return a warning that the load on the model differs from the measured load; None if it does not.

    The loads of a case are multiplied by the level of a test. Levels in newtons (or m/s^2) are the force (or
    acceleration) itself, so that the load must have an amplitude of 1 in SI units. Several loads, and loads for levels
    without a calibration, are not checked: their amplitudes may differ from 1.

    Parameters
    ----------
    loads
        Tables `[[load]]`.
    drive
        Quantity and unit of the levels of the campaign.
    """
    if len(loads) != 1 or not drive.calibrated:
        return None
    (load,) = loads
    quantity, amplitude = ("force", load.amplitude) if load.base is None else load.base_quantity
    # A load of another quantity than the measured one is refused elsewhere.
    if amplitude == 1.0 or quantity not in drive.quantity:
        return None
    unit = drive.unit
    return (
        f"[[load]] has an amplitude of {amplitude:g} {unit}, and the levels of the campaign are in {unit}: the model "
        f"would be driven by {amplitude:g} times the measured level; give {UNIT_AMPLITUDE[drive.quantity]}"
    )
