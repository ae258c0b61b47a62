"""Measured and predicted modes: pairs of modes, agreement of frequency responses, and free decays."""

from collections.abc import Iterator, Mapping

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.data_type.measured_response import MeasuredResponse
from correlation.modal.assurance import compute_response_assurance
from correlation.uncertainty.interval import TWO_SIDED_95
from study.compare.modal_view import ModalSet, ModalView
from study.compare.section.section import Section
from study.page.table import Table

#: With fewer sensors different shapes have a high MAC.
FEW_SENSORS = 4
#: Agreement below which a sensor or a response is reported [-].
LOW = 0.8
PAIRING = (
    "Measured modes and the linear modes of the model, paired by shape and nearness in frequency; the closed contacts "
    "of a jointed structure stick. MAC is 1 for equal shapes; a picture shows it for several modes, pairs are framed."
)
SENSORS = (
    "CoMAC is 1 for a sensor that moves as in the model in all pairs, the worst sensor first. It compares magnitudes "
    "only: a sensor with the opposite sign keeps its CoMAC and lowers the MAC of the modes."
)
RESPONSES = (
    "FRAC is 1 where the model's linear response has the shape of the measured one over frequency; a resonance that is "
    "off lowers it, even if the modes agree. Poles that come back at every order of the fit (stable) are modes; "
    "dotted lines mark those that were taken. FDAC is 1 where the measured deflection shape at one frequency is "
    "that of the model at another: a dark ridge beside the line of equal frequencies is a resonance that is off."
)
DECAYS = (
    "Frequency and damping ratio of each mode against its falling amplitude. The force that began the decay does not "
    "matter. With friction, damping peaks where contacts begin to slip; a linear structure shows horizontal lines."
)


def make_modal_sections(view: ModalView, drawn: Mapping[str, bytes]) -> Iterator[Section]:
    """Sections of a page: modes with shapes, agreement of responses, and free decays, if there are any.

    Parameters
    ----------
    view
        Result of `view_modes`.
    drawn
        Its pictures by name.
    """

    def pictures(*names: str) -> dict[str, bytes]:
        return {name: picture for name, picture in drawn.items() if name.rstrip("_0123456789") in names}

    if view.sets:
        head = ("modes", "measured [Hz]", "model [Hz]", "error", "measured \u03b6", "model \u03b6", "MAC")
        rows = [row for own in view.sets for row in _pair_rows(own)]
        text = " ".join(dict.fromkeys(sentence for own in view.sets for sentence in _judge_shapes(own)))
        yield Section(
            title="Mode pairing",
            text=f"{PAIRING} {text}",
            table=Table(head=head, rows=rows),
            pictures=pictures("mac"),
        )
    sensors = [row for own in view.sets for row in _format_sensor_rows(own)]
    if sensors:
        table = Table(head=("modes", "sensor", "CoMAC"), rows=sensors, words=2)
        yield Section(title="Sensors over the paired modes", text=SENSORS, table=table)
    if view.responses:
        rows = [
            [response.name, sensor, f"{value:.3f}"]
            for response, predicted in view.responses
            for sensor, value in zip(response.sensors, _compute_agreement(response, predicted), strict=True)
        ]
        yield Section(
            title="Frequency responses: poles and agreement",
            text=RESPONSES,
            table=Table(head=("response", "sensor", "FRAC"), rows=rows, words=2),
            pictures=pictures("stabilisation", "fdac"),
        )
    if view.decays:
        yield Section(title="Free decays", text=DECAYS, pictures=pictures("decay_backbone", "decay"))


def _pair_rows(own: ModalSet) -> list[list[str]]:
    """Pairs, measured modes without a partner, and unmeasured modes of the model."""
    rows = []
    for pair in own.pairing.pairs:
        mode, damping = own.measured[pair.measured], own.damping[pair.model]
        rows.append(
            [
                own.name, f"{mode.frequency:.3f} \u00b1 {TWO_SIDED_95 * mode.frequency_deviation:.2g}",
                f"{pair.model_frequency:.3f}", f"{pair.frequency_error:+.2%}", _format_percent(mode.damping),
                _format_percent(damping), f"{pair.assurance:.3f}",
            ]
        )  # fmt: skip
    alone = [own.measured[number] for number in own.pairing.measured_only]
    rows += [[own.name, f"{mode.frequency:.3f}", "none", "", _format_percent(mode.damping), "", ""] for mode in alone]
    rows += [
        [own.name, "not measured", f"{own.frequency[number]:.3f}", "", "", _format_percent(own.damping[number]), ""]
        for number in own.pairing.model_only
    ]
    return rows


def _format_sensor_rows(own: ModalSet) -> list[list[str]]:
    """CoMAC of each sensor of a set with two pairs or more, the lowest first."""
    rows = sorted(zip(own.coordinate.tolist(), own.sensors, strict=False))
    return [[own.name, sensor, f"{value:.3f}" if np.isfinite(value) else "at rest"] for value, sensor in rows]


def _format_percent(value: float) -> str:
    return f"{100 * value:.3f} %" if np.isfinite(value) else ""


def _judge_shapes(own: ModalSet) -> Iterator[str]:
    """Verdict of the assurance criteria, and their limits with few sensors."""
    if len(own.sensors) < FEW_SENSORS:
        yield (
            f"With {len(own.sensors)} sensors different shapes of the {own.configuration} structure may have a high "
            "MAC: rely more on the frequencies."
        )
    for sensor, value in zip(own.sensors, own.coordinate, strict=False):
        if value < LOW:
            yield (
                f"Sensor {sensor} agrees least over the pairs of {own.name} (CoMAC {value:.2f}): its place, direction "
                "or sign may be wrong, or the model is wrong there."
            )


def _compute_agreement(
    response: MeasuredResponse, predicted: Complex[NDArray[np.complex128], "c f"]
) -> NDArray[np.float64]:
    there = response.coherent_lines
    return np.asarray(compute_response_assurance(response.value[:, there], predicted[:, there]))
