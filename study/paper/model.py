"""The calibrated model with some parameters, and its small vibrations with all contacts stuck or without dampers."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, MeasuredSensor
from correlation.model import DERIVATIVE, Model, Sensor
from reduction.stuck import stick_at_rest
from study.case.setup import ReadCase, read_case
from study.case.tables import Case
from study.kind.registry import OpenCase
from study.kind.rig.table import RigTable
from study.paper.case import EffortTable
from study.paper.parameters import RigParameters, configure
from study.paper.resonance import find_small_peak, scale_damping
from study.run_context import RunContext

Real = Float[NDArray[np.float64], " f"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelInputs:
    """What the models of a rig depend on besides its parameters: the key of stored results.

    Parameters
    ----------
    case
        Case on the mesh of the model.
    sensors
        Sensors of the campaign.
    """

    case: Case[RigTable]
    sensors: tuple[MeasuredSensor, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class PaperModel:
    """Makes models of the rig that is calibrated.

    Parameters
    ----------
    opened
        Case of the rig on the mesh of the model.
    campaign
        Campaign whose sensors the models have.
    run
        Store of the reduced bodies, and progress.
    effort
        Effort of searches and fits.
    """

    opened: OpenCase
    campaign: Campaign
    run: RunContext
    effort: EffortTable

    @property
    def inputs(self) -> ModelInputs:
        """What the models depend on."""
        return ModelInputs(case=self.opened.case, sensors=self.campaign.sensors)

    def read(self, parameters: RigParameters) -> ReadCase:
        """The case with some parameters, and its model.

        Raises
        ------
        CaseError
            A damper leaves its groove, or finds no rest.
        """
        read = self._configured(parameters)
        model = scale_damping(read.setup.model, parameters.damping)
        return replace(read, setup=replace(read.setup, model=model))

    def find_ratio(self, parameters: RigParameters) -> float:
        """Damping ratio of the case for which the stuck peak has the ratio of the parameters [-]."""
        shown = find_small_peak(self._configured(parameters).setup.model, free=False).damping
        return parameters.damping**2 / shown

    def _configured(self, parameters: RigParameters) -> ReadCase:
        """The case with these parameters; the damping ratio of a case belongs to another mode than the peak."""
        case = configure(self.opened.case, parameters)
        return read_case(replace(self.opened, case=case), campaign=self.campaign, run=self.run)

    def __call__(self, parameters: RigParameters) -> Model:
        """The model with some parameters."""
        return self.read(parameters).setup.model


def compute_small_response(model: Model, sensor: str, frequency: Real, level: float, *, free: bool) -> Real:
    """Amplitude that a sensor reads in small vibrations, shape (f,) [SI unit of the sensor].

    Parameters
    ----------
    model
        Model with the sensor.
    sensor
        Name of a sensor of motion.
    frequency
        Frequencies, shape (f,) [Hz].
    level
        Amplitude of the force [N].
    free
        Whether without dampers.
    """
    system = (model.without_contacts() if free else model).system
    read = next(item for item in model.sensors if isinstance(item, Sensor) and item.name == sensor)
    stiffness, force = stick_at_rest(system.stiffness, system.joints), level * system.dynamic[1]
    result = [
        abs(read.row @ np.linalg.solve(stiffness + 1j * omega * system.damping - omega**2 * system.mass, force))
        * omega ** DERIVATIVE[read.quantity]
        for omega in 2 * np.pi * frequency
    ]
    return abs(read.gain) * np.array(result)
