r"""Phases with the wrong sign: conjugated complex numbers, and sensors with reversed polarity.

With :math:`e^{+i \Omega t}` a passive structure's displacement lags its load, with :math:`e^{-i \Omega t}` it leads.
The agreement of measured :math:`x` and expected :math:`y` is :math:`\Re \sum \bar{y} x / \sum |y| |x|`: 1 for equal
phases, -1 for opposite ones. At a resonance conjugation and a change of sign are equivalent, so that the explanation
that fits better over all frequencies is named.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.data_quality.derived_quantity import name_derived_quantity
from correlation.data_quality.phase_offset import find_phase_offset
from correlation.data_quality.repeat_array import arrange_repeats
from correlation.feature.table import FeatureTable
from correlation.row_group import group_rows

#: Phases are suspected from this agreement with the other sign on, and up to this one with their own [-]: near a
#: resonance, where the sign matters, correct phases reach 0.9 even with an inaccurate model.
OTHER, OWN = 0.9, 0.6
#: Least number of points to determine a sign.
FEWEST = 3
CONJUGATE, OPPOSITE = "the other sign of the imaginary parts", "the opposite sign"

Values = Complex[NDArray[np.complex128], " n"]


def find_conjugate_tests(
    campaign: Campaign, table: FeatureTable, predicted: Complex[NDArray[np.complex128], " k"]
) -> Iterator[Suspicion]:
    """Tests, or else single sensors, whose phases agree with the model only with the other sign.

    Parameters
    ----------
    campaign
        Campaign with its tests.
    table
        Features as measured.
    predicted
        Prediction of the model for each row, shape (k,).
    """
    phased = np.array([sensor.has_phase for sensor in campaign.sensors])[table.sensor]
    for number, test in enumerate(campaign.tests):
        here = (table.test == number) & (table.harmonic == 1) & np.isfinite(predicted) & phased
        weight = np.zeros(len(campaign.sensors))
        np.maximum.at(weight, table.sensor[here], np.abs(table.value[here]))
        scaled = table.value / np.where(weight > 0, weight, 1.0)[table.sensor]
        # An opposite sign of all sensors may be that of the force: it is suspected for single sensors only.
        if (judged := _judge(scaled[here], predicted[here])) and judged[0] == CONJUGATE:
            yield Suspicion(
                where=f'test "{test.name}"',
                sentence=(
                    f"{_describe_evidence(judged, 'the model')}: do the numbers have the other time convention? If so, "
                    "change the sign in convention.time of the manifest"
                ),
                of_test=True,
            )
            continue
        derived = {}
        for index, sensor in enumerate(campaign.sensors):
            rows = here & (table.sensor == index)
            with np.errstate(divide="ignore", invalid="ignore"):
                ratio = table.value[rows] / predicted[rows]
            if rows.any():
                derived[index] = name_derived_quantity(sensor.quantity, ratio, table.frequency[rows])
        curve = group_rows([table.sensor, table.level]).number
        turned = find_phase_offset(scaled[here], predicted[here], table.frequency[here], curve[here])
        if judged is None and turned and not all(derived.values()):
            angle, left = -np.degrees(turned.angle), np.degrees(turned.residual)
            middle = float(np.median(table.frequency[here]))
            yield Suspicion(
                where=f'test "{test.name}"',
                sentence=f"the phases of all sensors agree with the model to {turned.agreement:.2f} (1 is perfect), "
                f"and within {left:.2g} deg if each is turned by {angle:+.0f} deg, which is "
                f"{abs(angle) / 360e-3 / middle:.2g} ms at {middle:.4g} Hz: are they relative to the force, and "
                "sampled at the same time through equal filters? If not, subtract the phase of the force",
                of_test=True,
            )
            continue
        for index, quantity in derived.items():
            sensor, rows = campaign.sensors[index], here & (table.sensor == index)
            judged = _judge(table.value[rows], predicted[rows])
            own = find_phase_offset(table.value[rows], predicted[rows], table.frequency[rows], curve[rows])
            where = f'test "{test.name}", sensor "{sensor.name}"'
            agreement = own.agreement if own else judged[1] if judged and judged[0] == OPPOSITE else None
            if quantity and agreement is not None:
                yield Suspicion(
                    where=where,
                    sentence=f"the phases agree with the model to {agreement:.2f} (1 is perfect); by phase and size, "
                    f"the numbers are those of {quantity}: are they declared as {sensor.quantity} by mistake? If so, "
                    "correct the quantity of the sensor",
                )
            elif judged:
                yield Suspicion(
                    where=where, sentence=f"{_describe_evidence(judged, 'the model')}: {_format_question(judged[0])}"
                )


def find_conjugate_repeats(campaign: Campaign) -> Iterator[Suspicion]:
    """Repeats in which phases agree with the other repeats only with the other sign.

    Parameters
    ----------
    campaign
        Campaign with several repeats.
    """
    for number, test in enumerate(campaign.tests):
        table = campaign.measurement.where(campaign.measurement.test == number)
        result: dict[tuple[int, str], list[tuple[str, tuple[str, float, float]]]] = {}
        for index, sensor in enumerate(campaign.sensors):
            if not sensor.has_phase:
                continue
            arranged = arrange_repeats(table, [index])
            values = arranged.value[0]
            for column, repeat in enumerate(arranged.repeat):
                if judged := _judge(values[:, column], _average_repeats(np.delete(values, column, axis=1))):
                    result.setdefault((repeat, judged[0]), []).append((sensor.name, judged))
        for (repeat, explanation), sensors in result.items():
            names = ", ".join(f'"{name}"' for name, _ in sensors)
            judged = min((item for _, item in sensors), key=lambda item: item[1])
            yield Suspicion(
                where=f'test "{test.name}", repeat {repeat}, {names}',
                sentence=f"{_describe_evidence(judged, 'the other repeats')}: {_format_question(explanation)}",
            )


def _average_repeats(values: Complex[NDArray[np.complex128], "n r"]) -> Values:
    """Mean of the available repeats; NaN without any."""
    there = np.isfinite(values)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(there, values, 0).sum(axis=1) / there.sum(axis=1))


def _judge(value: Values, expected: Values) -> tuple[str, float, float] | None:
    """The sign that explains values, and their agreement as they are and with that sign; None if they are right."""
    there = np.isfinite(value) & np.isfinite(expected) & (np.abs(expected) > 0)
    value = value[there]
    size: Float[NDArray[np.float64], " n"] = np.abs(value)
    if len(value) < FEWEST or not size.sum():
        return None
    # Only the phases of the expected values are used: their peak may lie elsewhere.
    phase = expected[there] / np.abs(expected[there])
    own = float((value * phase.conj()).real.sum() / size.sum())
    conjugate = float((value * phase).real.sum() / size.sum())
    other, explanation = max((conjugate, CONJUGATE), (-own, OPPOSITE))
    return (explanation, own, other) if other > OTHER and own < OWN else None


def _describe_evidence(judged: tuple[str, float, float], reference: str) -> str:
    explanation, own, other = judged
    return f"the phases agree with {reference} to {own:.2f}, and to {other:.2f} with {explanation} (1 is perfect)"


def _format_question(explanation: str) -> str:
    if explanation == CONJUGATE:
        return "do these numbers have the other time convention? If so, change the sign of their imaginary parts"
    return "was the sensor mounted the other way round, or its cable reversed? If so, change the sign of its values"
