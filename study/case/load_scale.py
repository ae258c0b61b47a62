"""Whether the loads of a case are those of a campaign: both tell how strongly the structure is driven."""

from collections.abc import Sequence

from correlation.campaign.measurement import Drive
from study.case.load_table import LoadTable

#: What an amplitude of 1 is, by what the levels of a campaign are.
ONE = {"force": 'amplitude = "1 N"', "base acceleration": 'acceleration = "1 m/s^2"'}


def find_scale_warning(loads: Sequence[LoadTable], drive: Drive) -> str | None:
    """Warning in words that a model is driven by more or less than was measured; None if it is not.

    The loads of a case are scaled by the level of a test. Levels in newtons (or m/s^2) are the force itself, so that
    the loads have an amplitude of 1 in SI. Several loads may share it, and loads of levels without a calibration may
    have any.

    Parameters
    ----------
    loads
        Tables `[[load]]`.
    drive
        What the levels of the campaign are.
    """
    if len(loads) != 1 or not drive.calibrated:
        return None
    (load,) = loads
    quantity, amplitude = ("force", load.amplitude) if load.base is None else load.base_quantity
    # What moves otherwise than it was measured is refused elsewhere.
    if amplitude == 1.0 or quantity not in drive.quantity:
        return None
    unit = drive.unit
    return (
        f"[[load]] has an amplitude of {amplitude:g} {unit}, and the levels of the campaign are in {unit}: the model "
        f"would be driven by {amplitude:g} times the measured level; give {ONE[drive.quantity]}"
    )
