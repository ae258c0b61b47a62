"""Suspected mistakes of modes, frequency responses, ring-downs and loops by comparison with a model, with evidence."""

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Suspicion
from correlation.data_quality.frequency_unit import find_wrong_frequency_unit
from correlation.data_quality.loop_mistake import find_loop_mistake
from correlation.data_quality.response_size import find_wrong_size
from correlation.data_quality.time_base import find_wrong_time_base
from correlation.data_type.measured_loop import ForceLoop
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.mode import MeasuredMode, compute_linear_modes, shape_at_sensors
from correlation.data_type.mode_set import group_modes
from correlation.data_type.registry import Datum
from correlation.data_type.ring_down import FreeDecay
from correlation.errors import CampaignError
from correlation.modal.assurance import compute_modal_assurance
from correlation.model import Model

Frequencies = Float[NDArray[np.float64], " m"]

#: Least MAC of a measured mode and a corresponding mode of the model, if there are shapes [-].
MIN_MAC = 0.8


def find_response_suspicions(model: Model, data: Sequence[Datum]) -> tuple[Suspicion, ...]:
    """Suspected mistakes of frequency units, sensors, sizes of responses, time bases of decays and units of loops.

    Parameters
    ----------
    model
        Model with the sensors of the campaign.
    data
        Data of a campaign.
    """
    tests: list[tuple[str, Sequence[MeasuredMode]]] = [
        (item.name, item.modes) for item in data if isinstance(item, MeasuredResponse)
    ]
    tests.append(("modes", [item for item in data if isinstance(item, MeasuredMode)]))
    result: list[Suspicion] = []
    for name, modes in tests:
        try:
            result += _suspect_frequency_unit(model, name, modes) or _suspect_sensors(model, name, modes)
        except CampaignError:
            continue  # a sensor that the model lacks is reported by the comparison
    for item in data:
        with suppress(CampaignError):  # as above
            if isinstance(item, MeasuredResponse):
                result += find_wrong_size(model, item)
            if isinstance(item, FreeDecay):
                result += find_wrong_time_base(model, item)
            if isinstance(item, ForceLoop):
                result += find_loop_mistake(model, item)
    return tuple(result)


def _suspect_frequency_unit(model: Model, name: str, modes: Sequence[MeasuredMode]) -> list[Suspicion]:
    """Common factor of a unit between all measured modes and those of the model."""
    candidates = [_list_partners(model, mode) for mode in modes]

    def distance(factor: float) -> Frequencies:
        pairs = zip(modes, candidates, strict=True)
        return np.array([np.abs(np.log(factor * own / mode.frequency)).min(initial=np.inf) for mode, own in pairs])

    wrong = find_wrong_frequency_unit(distance)
    if wrong is None:
        return []
    listed = ", ".join(f"{mode.frequency:.4g}" for mode in modes[:4])
    return [
        Suspicion(
            where=name,
            sentence=f"its modes at {listed} Hz are {wrong.words} those of the model, and none is near one as stated: "
            f'is the frequency in {wrong.likely}? If so, write unit = "{wrong.likely}" for its column',
        )
    ]


def _list_partners(model: Model, mode: MeasuredMode) -> Frequencies:
    """Frequencies of the model's modes that may correspond to a measured one, by shape if there is one [Hz]."""
    frequency, _, shapes = compute_linear_modes(model, mode.configuration)
    elastic = frequency > 0
    frequency, shapes = frequency[elastic], shapes[:, elastic]
    if not mode.sensors:
        return frequency
    seen = shape_at_sensors(model, mode.sensors, frequency, shapes)
    moves = np.abs(seen).max(axis=0, initial=0.0) > 0
    return np.asarray(frequency[moves][compute_modal_assurance(mode.shape[:, None], seen[:, moves])[0] > MIN_MAC])


def _suspect_sensors(model: Model, name: str, modes: Sequence[MeasuredMode]) -> Iterator[Suspicion]:
    """Sensors that are swapped, or one that is reversed."""
    for group in group_modes(model, modes):
        mistake = group.mistake
        if mistake is None:
            continue
        names = " and ".join(f'"{group.sensors[row]}"' for row in mistake.sensors)
        swapped = len(mistake.sensors) > 1
        change = "if these two are swapped" if swapped else "with the opposite sign of this sensor"
        asked = "check the cables" if swapped else "was it mounted the other way round? If so, write sign = -1"
        if len(group.sensors) == 2 and not swapped:
            names, change = " or ".join(f'"{sensor}"' for sensor in group.sensors), "with the opposite sign of one"
        yield Suspicion(
            where=f"{name}, {names}",
            sentence=f"the shapes of {len(group.modes)} modes agree with those of the model to a mean MAC of "
            f"{mistake.before:.2f}, and of {mistake.after:.2f} {change}: {asked}",
        )
