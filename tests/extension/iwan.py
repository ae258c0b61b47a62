"""A four-element Iwan chain: Jenkins elements in parallel whose limits are spread evenly."""

from reduction.joint_law.function_law import joint_law
from reduction.joint_law.registry import LawParameter


def slide(u, slider, stiffness, limit):
    force = stiffness * (u - slider)
    if force > limit:
        return limit, u - limit / stiffness
    if force < -limit:
        return -limit, u + limit / stiffness
    return force, slider


def stored(u, state, parameters):
    return sum(0.5 * parameters[0] / 4 * (u - slider) ** 2 for slider in state)


@joint_law(
    kind="iwan",
    parameters=[
        LawParameter(name="stiffness", unit="N/m", meaning="of all elements together", typical=1e6, positive=True),
        LawParameter(name="limit_force", unit="N", meaning="of all elements together", typical=10.0, positive=True),
    ],
    typical_displacement=2e-5,
    n_state=4,
    stuck_stiffness=lambda stiffness, _limit_force: stiffness,
    energy=stored,
)
def iwan(u, velocity, state, parameters):
    """Four Jenkins elements in parallel; their limits are 1, 3, 5 and 7 sixteenths of the whole."""
    stiffness, limit = parameters
    f0, w0 = slide(u, state[0], stiffness / 4, limit / 16)
    f1, w1 = slide(u, state[1], stiffness / 4, 3 * limit / 16)
    f2, w2 = slide(u, state[2], stiffness / 4, 5 * limit / 16)
    f3, w3 = slide(u, state[3], stiffness / 4, 7 * limit / 16)
    return f0 + f1 + f2 + f3, (w0, w1, w2, w3)
