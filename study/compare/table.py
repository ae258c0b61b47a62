"""All points of a comparison as a table."""

import csv
from io import StringIO

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.metric.misfit import Misfit, configuration
from correlation.metric.response import amplitude_error, phase_error

COLUMNS = (
    "set", "configuration", "level_N", "frequency_Hz", "sensor", "harmonic", "unit", "measured_real", "measured_imag",
    "deviation", "predicted_real", "predicted_imag", "amplitude_error", "phase_error_deg",
    "standardised_real", "standardised_imag", "whitened_real", "whitened_imag",
)  # fmt: skip


def misfit_csv(campaign: Campaign, train: Misfit, held: Misfit | None) -> str:
    """One line a point of the training data and of what is held out; what does not exist is empty.

    Parameters
    ----------
    campaign
        Knows the units.
    train, held
        Misfits.
    """
    units = {sensor.name: sensor.unit for sensor in campaign.sensors}
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for name, of in (("training", train), ("held out", held)):
        if of is None:
            continue
        points = of.points
        with np.errstate(invalid="ignore", divide="ignore"):
            amplitude = amplitude_error(of.measured, of.predicted)
            phase = np.degrees(phase_error(of.measured, of.predicted))
        for row in range(len(of)):
            numbers = (
                of.measured[row].real, of.measured[row].imag, of.deviation[row], of.predicted[row].real,
                of.predicted[row].imag, amplitude[row], phase[row], *of.standardised[row], *of.whitened[row],
            )  # fmt: skip
            sensor = str(points.sensor[row])
            writer.writerow(
                [
                    name,
                    configuration(bool(points.free[row])),
                    f"{points.level[row]:.9g}",
                    f"{points.frequency[row]:.9g}",
                    sensor,
                    int(points.harmonic[row]),
                    units[sensor],
                    *(f"{number:.7g}" if np.isfinite(number) else "" for number in numbers),
                ]
            )
    return stream.getvalue()
