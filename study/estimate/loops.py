"""Contact stiffness and friction from force-displacement loops."""

from collections.abc import Iterator

import numpy as np

from correlation.data_type.measured_loop import ForceLoop
from correlation.errors import CampaignError
from correlation.model import Model
from correlation.signal.stick_slip import Estimate, StickSlip, estimate_stick_slip
from diagnosis.candidate.contact_line import find_contacts, scale_contacts
from diagnosis.fit.calibration_parameter import BOUNDS, CONTACT
from reduction.stuck import stick_at_rest
from study.estimate.first_estimate import FirstEstimate

LEANS = (
    "an inclined laser, or a place beside the contact, reads less than the motion of the contact: the stiffness is "
    "biased high, by a factor of two or more for a stiff contact"
)
SHARED = "the displacement of the loop includes that of the structure next to the contact: the stiffness is biased low"
LOWER = "gross slip is not reached: a lower bound"
#: Factors on the contact stiffness at which the stiffness of a place is computed, for interpolation [-].
GRID = np.geomspace(*BOUNDS["kt"], 60)


def estimate_from_loop(model: Model, loop: ForceLoop) -> Iterator[FirstEstimate]:
    """Estimate contact stiffness and, for a loop of a contact line, the friction coefficient from one loop.

    Raises
    ------
    CampaignError
        If the loop has no settled period, its line or place is not in the model, the stiffness of its place does not
        depend on the contacts, or the measured stiffness is beyond the range of the model.
    """
    try:
        result = estimate_stick_slip(loop.displacement, loop.force)
    except CampaignError as error:
        raise CampaignError(f'loop "{loop.name}": {error}') from error
    if loop.line is not None:
        yield from _estimate_line(model, loop, result)
        return
    if loop.place is None or loop.place not in model.places:
        raise CampaignError(f'loop "{loop.name}": the model has no place "{loop.place}"')
    stuck = np.array([_compute_stiffness(model, loop.place, factor) for factor in GRID])
    stiffness = result.tangential_stiffness
    if not np.ptp(stuck) > 1e-3 * stuck.mean():
        raise CampaignError(f'loop "{loop.name}": the stiffness at "{loop.place}" does not depend on the contacts')
    factors = [
        float(np.interp(value, stuck, GRID, left=0.0, right=np.inf)) for value in (stiffness.value, *stiffness.interval)
    ]
    own = float(sum(contact.tangential_stiffness for line in model.lines for contact in find_contacts(model, line)))
    if not 0 < factors[0] < np.inf:
        raise CampaignError(
            f'loop "{loop.name}": its stiffness of {stiffness.value:.4g} N/m is beyond what the model can have at '
            f'"{loop.place}" ({stuck[0]:.4g} to {stuck[-1]:.4g} N/m): the structure of the model is wrong, not its '
            "contacts"
        )
    yield FirstEstimate(
        parameter="kt",
        value=factors[0] * own,
        interval=(factors[1] * own, factors[2] * own),
        unit="N/m",
        model_value=own,
        source=f'loop "{loop.name}", through the stuck model',
        bias=(LEANS, *result.suspicions),
    )


def _estimate_line(model: Model, loop: ForceLoop, result: StickSlip) -> Iterator[FirstEstimate]:
    if loop.line not in model.lines:
        raise CampaignError(f'loop "{loop.name}": the model has no line "{loop.line}"')
    contacts = find_contacts(model, str(loop.line))
    stiffness = sum(contact.tangential_stiffness for contact in contacts)
    yield _estimate("kt", result.tangential_stiffness, "N/m", stiffness, loop, (LEANS, SHARED, *result.suspicions))
    limit = sum(contact.friction_coefficient * max(contact.preload, 0.0) for contact in contacts)
    normal = sum(max(contact.preload, 0.0) for contact in contacts)
    if normal > 0:
        friction = result.friction_force
        scaled = Estimate(
            value=friction.value / normal,
            deviation=friction.deviation / normal,
            interval=(friction.interval[0] / normal, friction.interval[1] / normal),
        )
        bias = (f"the normal force is that of the model's preload, {normal:.4g} N",)
        yield _estimate("mu", scaled, "-", limit / normal, loop, bias if result.gross_slip else (LOWER, *bias))


def _estimate(
    parameter: str, estimate: Estimate, unit: str, model_value: float, loop: ForceLoop, bias: tuple[str, ...]
) -> FirstEstimate:
    return FirstEstimate(
        parameter=parameter,
        value=estimate.value,
        interval=estimate.interval,
        unit=unit,
        model_value=float(model_value),
        source=f'loop "{loop.name}"',
        bias=bias,
    )


def _compute_stiffness(model: Model, place: str, factor: float) -> float:
    """Stiffness of a place [N/m]; all contacts that are closed at rest are stuck, with a factor on their k_t."""
    scaled = scale_contacts(model, dict.fromkeys(model.lines, factor), CONTACT["kt"])
    row = model.places[place]
    return float(1 / (row @ np.linalg.solve(stick_at_rest(scaled.system.stiffness, scaled.system.joints), row)))
