"""A joint law of your own in fifteen lines: Dahl's friction, whose stiffness fades as the force nears its limit."""

from math import exp

import numpy as np
from matplotlib.figure import Figure

from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.continuation.response import frequency_response
from hbsolve.steady_state import steady_state
from reduction.joint_law.function_law import joint_law
from reduction.joint_law.registry import LawParameter
from reduction.jointed_system import JointedSystem


@joint_law(
    kind="dahl",
    parameters=[
        LawParameter(name="stiffness", unit="N/m", meaning="at rest", typical=1e5, positive=True),
        LawParameter(name="limit", unit="N", meaning="of the force", typical=2.0, positive=True),
    ],
    typical_displacement=5e-5,
    n_state=2,  # force and displacement of the instant before
    stuck_stiffness=lambda stiffness, *_: stiffness,
    energy=None,
)
def dahl(u, velocity, state, parameters):
    """dF = k (1 - F sign(du) / limit) du, integrated exactly over a step."""
    stiffness, limit = parameters
    force, step = state[0], u - state[1]
    side = 1.0 if step >= 0.0 else -1.0
    force = side * limit + (force - side * limit) * exp(-stiffness * abs(step) / limit)
    return force, (force, u)


M, K, C = np.eye(1), np.array([[9e4]]), np.array([[2.0]])
joint = dahl(name="joint", direction=np.ones(1), stiffness=4e4, limit=2.0)
system = JointedSystem(mass=M, damping=C, stiffness=K, joints=[joint], harmonic_force=[[0.0], [1.0]])
balance = HarmonicBalance(system=system, n_harmonic=10, n_sample=1024)

figure = Figure(figsize=(10, 4.4), layout="constrained", dpi=120)
response, loops = figure.subplots(1, 2)
for level in (0.2, 0.6, 1.2, 2.2):
    at_level = balance.at_level(level)
    curve = frequency_response(at_level, 2 * np.pi * 40, 2 * np.pi * 65)
    peak = int(curve.amplitude(0).argmax())
    state = steady_state(at_level, curve.angular_frequency[peak], start=curve.start(at_level, peak))
    motion = contact_motion(at_level, state)[0]
    response.plot(curve.frequency, 1e6 * curve.amplitude(0) / level, label=f"{level:g} N")
    loops.plot(1e6 * motion.displacement[0], motion.force[0])
    # The loop between -A and A takes 4 L A - 4 L^2 / k tanh(k A / L), whatever the motion between them.
    half = np.ptp(motion.displacement[0]) / 2
    area = 4 * 2.0 * half - 4 * 2.0**2 / 4e4 * np.tanh(4e4 * half / 2.0)
    print(f"{level:4g} N: {1e6 * half:6.2f} um at {state.frequency:.2f} Hz, "
          f"{motion.dissipated[0]:.3e} J per period, closed form {area:.3e} J")  # fmt: skip
    assert np.isclose(motion.dissipated[0], area, rtol=1e-3)  # of 1024 instants and ten harmonics
response.set(xlabel="frequency [Hz]", ylabel="amplitude / force [µm/N]")
loops.set(xlabel="displacement [µm]", ylabel="force of the joint [N]")
response.legend()
figure.savefig("own_joint_law.png")
print("drawn in own_joint_law.png")
