r"""An oscillator of one degree of freedom from a time record, to start from where there is no model.

.. math:: (K + i \omega C - \omega^2 M)\, Y = U

is fitted to the spectra of response and force, each line weighted by the inverse of the last fit's response.

References
----------
Sanathanan and Koerner, IEEE Transactions on Automatic Control 8 (1963) 56.
"""

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.campaign.time_record import TimeRecord
from correlation.errors import CampaignError
from correlation.model import Model, Sensor
from reduction.jointed_system import JointedSystem

#: Rounds of weighting, and the share of the largest force spectrum that a line must have.
ROUNDS, LEAST = 8, 1e-2


def fit_single_dof(record: TimeRecord, sensor: str) -> Model:
    """The linear oscillator that answers to the record's force most like its sensor.

    Mass, damping and stiffness are in units of force over those of the sensor: in a record in volts both are V.

    Parameters
    ----------
    record
        Record with a force and a uniform step.
    sensor
        Channel that is a displacement, or proportional to one.

    Raises
    ------
    CampaignError
        A record without a force, or without a fitting oscillator.
    """
    if record.force is None:
        raise CampaignError(f'record "{record.name}" has no force: an oscillator needs one, give a model instead')
    window = np.hanning(len(record.time))
    force, response = (_compute_spectrum(record.channel(name), window) for name in (record.force, sensor))
    omega = 2 * np.pi * np.fft.rfftfreq(len(record.time), record.step)
    used = np.abs(force) >= LEAST * np.abs(force).max()
    force, response, s = force[used], response[used], 1j * omega[used]
    weight, scale = np.ones(len(s)), omega[used].max()
    columns = np.stack([np.ones_like(s), s / scale, (s / scale) ** 2], axis=1) * response[:, None]
    for _ in range(ROUNDS):
        table, right = columns * weight[:, None], force * weight
        real = np.concatenate([table.real, table.imag])
        result = np.linalg.lstsq(real, np.concatenate([right.real, right.imag]), rcond=None)[0]
        stiffness, damping, mass = (float(item) for item in result / scale ** np.arange(3))
        weight = 1 / np.abs(stiffness + damping * s + mass * s**2)
    if not (stiffness * mass > 0 and damping * mass > 0):
        raise CampaignError(
            f'record "{record.name}": "{sensor}" does not follow "{record.force}" like an oscillator (stiffness '
            f"{stiffness:.3g}, damping {damping:.3g}, mass {mass:.3g}): give a model instead"
        )
    sign = float(np.sign(mass))
    one = np.ones(1)
    system = JointedSystem(
        mass=np.array([[abs(mass)]]),
        damping=np.array([[abs(damping)]]),
        stiffness=np.array([[abs(stiffness)]]),
        harmonic_force=np.array([[0.0], [sign]]),
    )
    return Model(system=system, sensors=(Sensor(name=sensor, row=one),), places={"mass": one})


def _compute_spectrum(
    values: Float[NDArray[np.float64], " n"], window: Float[NDArray[np.float64], " n"]
) -> Complex[NDArray[np.complex128], " f"]:
    return np.fft.rfft((values - values.mean()) * window)
