"""Modal view of a campaign: modes identified from frequency responses, paired with the model's, and free decays.

`stickslip compare` shows it below the numbers of each type of data.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.data_type.linear_response import predict_linear_response
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.mode import MeasuredMode, list_motion_sensors
from correlation.data_type.mode_set import group_modes
from correlation.data_type.registry import Datum
from correlation.data_type.ring_down import LEAST_DAMPING, LEAST_FREQUENCY, FreeDecay, choose_rows
from correlation.errors import CampaignError
from correlation.modal.assurance import compute_coordinate_assurance, compute_domain_assurance, compute_modal_assurance
from correlation.modal.pairing import Pairing, pair_modes
from correlation.model import DERIVATIVE, Model
from figure.backbone import BackboneCurve, Backbones
from figure.fdac_map import FdacMap
from figure.mac_matrix import MacMatrix
from figure.ring_down import DecayDrawing
from figure.stabilisation import StabilisationDrawing
from study.compare.data import DataComparison

#: Largest number of curves of one set of backbones, and of pictures of one kind.
MOST_CURVES, MOST_PICTURES = 6, 4
#: Frequencies of a map of deflection shapes, of the test and of the model.
MOST_LINES = 300


@dataclass(frozen=True, kw_only=True, eq=False)
class ModalSet:
    """Measured modes with shapes at the same sensors, and those of the model.

    Parameters
    ----------
    configuration, sensors
        Common configuration and sensors.
    measured
        Modes by ascending frequency.
    frequency, damping
        Natural frequencies and damping ratios of the model's modes near the measured ones, shape (m,) [Hz, -].
    pairing
        Pairs of measured and predicted modes.
    coordinate
        CoMAC of each sensor over the pairs, shape (c,); empty for fewer than two pairs.
    """

    configuration: str
    sensors: tuple[str, ...]
    measured: tuple[MeasuredMode, ...]
    frequency: NDArray[np.float64]
    damping: NDArray[np.float64]
    pairing: Pairing
    coordinate: NDArray[np.float64]

    @property
    def name(self) -> str:
        """Source of the modes: a frequency response, or the structure for modes of the manifest."""
        return self.measured[0].name.rpartition(", mode")[0] or self.configuration


@dataclass(frozen=True, kw_only=True, eq=False)
class ModalView:
    """Tables and figures of the modes of a campaign.

    Parameters
    ----------
    sets
        Modes with shapes.
    responses
        Frequency responses with their modes, and the predicted responses, shape (c, f).
    decays
        Ring-downs, and their predicted numbers, shape (m,).
    """

    sets: tuple[ModalSet, ...] = ()
    responses: tuple[tuple[MeasuredResponse, Complex[NDArray[np.complex128], "c f"]], ...] = ()
    decays: tuple[tuple[FreeDecay, NDArray[np.float64]], ...] = ()
    figures: dict[str, object] = field(default_factory=dict)


def view_modes(model: Model, data: Sequence[Datum], compared: Sequence[DataComparison], title: str) -> ModalView:
    """Pair, compare and draw; data that the model cannot be compared with are left out, see `compare_data`.

    Parameters
    ----------
    model
        Model with the sensors of the campaign.
    data, compared
        Data of the campaign, and the result of `compare_data`.
    title
        Title of the case.
    """
    # Each test contains a mode at most once; another test may contain it too.
    tests: list[Sequence[MeasuredMode]] = [[item for item in data if isinstance(item, MeasuredMode)]]
    responses, decays = [], []
    for item, result in zip(data, compared, strict=True):
        if isinstance(item, MeasuredResponse) and item.fit is not None:
            tests.append(item.modes)
            if not result.reason:
                responses.append((item, predict_linear_response(model, item)))
        elif isinstance(item, FreeDecay):
            decays.append((item, result.predicted))
    sets = tuple(own for modes in tests for own in _find_sets(model, modes))
    view = ModalView(sets=sets, responses=tuple(responses), decays=tuple(decays))
    view.figures.update(_draw(model, view, title))
    return view


def _find_sets(model: Model, modes: Sequence[MeasuredMode]) -> Iterator[ModalSet]:
    """Modes of one test with shapes, by configuration and sensors."""
    try:
        groups = [*group_modes(model, modes)]
    except CampaignError:
        return  # the text reports the reason
    for group in groups:
        measured = np.array([mode.frequency for mode in group.modes])
        # Pair by shapes corrected for swapped sensors; the MAC is that of the shapes as measured.
        pairing = pair_modes(measured, group.corrected_shape, group.frequency, group.model_shape)
        assurance = compute_modal_assurance(group.shape, group.model_shape)
        pairs = tuple(replace(one, assurance=float(assurance[one.measured, one.model])) for one in pairing.pairs)
        pairing = replace(pairing, pairs=pairs, assurance=assurance)
        rows, columns = [pair.measured for pair in pairs], [pair.model for pair in pairs]
        # For a single mode the CoMAC adds nothing to the MAC.
        coordinate = (
            compute_coordinate_assurance(group.shape[:, rows], group.model_shape[:, columns]) if len(rows) > 1 else ()
        )
        yield ModalSet(
            configuration=group.configuration, sensors=group.sensors, measured=group.modes,
            frequency=group.frequency, damping=group.damping, pairing=pairing, coordinate=np.asarray(coordinate),
        )  # fmt: skip


def _draw(model: Model, view: ModalView, title: str) -> dict[str, object]:
    """Results to draw, by the names of their files."""
    drawn: dict[str, object] = {}
    # Do not draw a single number.
    sets = [own for own in view.sets if own.pairing.assurance.size > 1]
    for number, own in enumerate(sets[:MOST_PICTURES], start=1):
        drawn[f"mac{_format_suffix(number, len(sets))}"] = MacMatrix(
            assurance=own.pairing.assurance,
            measured=np.array([mode.frequency for mode in own.measured]),
            model=own.frequency,
            pairs=[(pair.measured, pair.model) for pair in own.pairing.pairs],
            title=f"{title}: modes of {own.name}",
            subtitle=f"modal assurance criterion at {len(own.sensors)} sensors; pairs are framed",
        )
    for number, (response, _) in enumerate(view.responses[:MOST_PICTURES], start=1):
        fit = response.fit
        assert fit is not None
        diagram, order = fit.stabilisation, _list_derivatives(model, response)
        there = response.coherent_lines  # the lines of the fit
        line = response.frequency[there]
        measured, fitted = (
            np.sqrt((np.abs(values / (2 * np.pi * line) ** order) ** 2).mean(axis=0))
            for values in (response.value[:, there], fit.fitted)
        )
        drawn[f"stabilisation{_format_suffix(number, len(view.responses))}"] = StabilisationDrawing(
            order=diagram.order,
            frequency=diagram.frequency,
            stable=diagram.stable,
            line=line,
            response=measured,
            fitted=fitted,
            chosen=fit.frequency,
            response_label=f"displacement, r.m.s. [m per {response.units[0].partition(' per ')[2]}]",
            title=f"{title}: {response.name}",
            subtitle="poles over the order of the fit",
        )
    several = [pair for pair in view.responses if len(pair[0].sensors) > 1]
    for number, (response, predicted) in enumerate(several[:MOST_PICTURES], start=1):
        drawn[f"fdac{_format_suffix(number, len(several))}"] = _compare_shapes(model, response, predicted, title)
    for number, (decay, _) in enumerate(view.decays[:MOST_PICTURES], start=1):
        drawn[f"decay{_format_suffix(number, len(view.decays))}"] = DecayDrawing(
            time=decay.time,
            signal=decay.signal,
            modes=[
                (f"{np.median(mode.frequency):.4g} Hz", mode.time, mode.amplitude) for mode in decay.modes
            ],
            floor=max((mode.noise_floor for mode in decay.modes), default=0.0),
            signal_label=f"{decay.sensor} [{decay.unit}]",
            title=f"{title}: {decay.name}",
            subtitle="free decay and the amplitudes of its modes",
        )  # fmt: skip
    units = list(dict.fromkeys(decay.unit for decay, _ in view.decays))
    for unit in units:
        curves = [
            curve for decay, predicted in view.decays if decay.unit == unit for curve in _make_curves(decay, predicted)
        ]
        if curves:
            drawn[f"decay_backbone{_format_suffix(units.index(unit) + 1, len(units))}"] = Backbones(
                curves=curves[:MOST_CURVES],
                amplitude_label=f"amplitude [{unit}]",
                title=f"{title}: backbones of free decays",
                subtitle="bands are 95 % intervals, dashed lines the model; the legend has the frequencies",
            )
    return drawn


def _compare_shapes(
    model: Model, response: MeasuredResponse, predicted: Complex[NDArray[np.complex128], "c f"], title: str
) -> FdacMap:
    """FDAC of the displacements of a measured and a predicted response, at most `MOST_LINES` frequencies of each."""
    # At 0 Hz accelerometers read zero, which has no shape.
    there = np.flatnonzero(response.coherent_lines & response.value.any(axis=0) & predicted.any(axis=0))
    there = there[np.unique(np.linspace(0, len(there) - 1, MOST_LINES).round().astype(int))]
    line = response.frequency[there]
    scale = (2 * np.pi * line) ** _list_derivatives(model, response)
    return FdacMap(
        assurance=compute_domain_assurance(response.value[:, there] / scale, predicted[:, there] / scale),
        measured=line,
        model=line,
        title=f"{title}: {response.name}",
        subtitle=f"frequency domain assurance criterion of deflection shapes at {len(response.sensors)} sensors",
    )


def _list_derivatives(model: Model, response: MeasuredResponse) -> NDArray[np.int64]:
    """Time derivatives of the displacement that each row of a response is, shape (c, 1)."""
    return np.array([[DERIVATIVE[sensor.quantity]] for sensor in list_motion_sensors(model, response.sensors)])


def _format_suffix(number: int, count: int) -> str:
    return "" if count == 1 else f"_{number}"


def _make_curves(decay: FreeDecay, predicted: NDArray[np.float64]) -> list[BackboneCurve]:
    """Measured backbone of each mode, and that of the model where it has one."""
    curves, first, table = [], 0, predicted.reshape(-1, 2)
    for mode in decay.modes:
        rows = choose_rows(mode)
        own, first = table[first : first + len(rows)], first + len(rows)
        reference = float(np.median(mode.frequency))
        # Draw a curve only where it is compared: its extrapolation is arbitrary.
        there = slice(rows[0], rows[-1] + 1)
        frequency, damping = mode.frequency[there], mode.damping_ratio[there]
        curves.append(
            BackboneCurve(
                label=f"{decay.name}, {reference:.4g} Hz", amplitude=mode.amplitude[there], frequency=frequency,
                frequency_deviation=np.hypot(mode.frequency_deviation[there], LEAST_FREQUENCY * frequency),
                damping=damping,
                damping_deviation=np.hypot(mode.damping_deviation[there], LEAST_DAMPING * np.abs(damping)),
                reference=reference,
            )
        )  # fmt: skip
        if np.isfinite(own).all(axis=1).sum() > 1:
            none = np.zeros(len(rows))
            curves.append(
                BackboneCurve(
                    label="model", amplitude=mode.amplitude[rows], frequency=own[:, 0],
                    frequency_deviation=none, damping=own[:, 1], damping_deviation=none, reference=reference,
                    kind="model",
                )
            )  # fmt: skip
    return curves
