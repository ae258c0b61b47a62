"""A chain with friction, lift-off and a cubic spring, from plain matrices: folds, friction loops, contact states."""

import numpy as np
from matplotlib.figure import Figure

from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.continuation.response import frequency_response
from hbsolve.steady_state import steady_state
from reduction.jointed_system import CubicSpring, FrictionContact, JointedSystem, along, between

M = np.eye(3)
K = 4e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
C = 1e-4 * K
wedge = along(3, {2: 0.5})  # an inclined wall: the motion of the last mass adds to the normal load
rub = FrictionContact(name="rub", tangents=between(3, 2), normal=wedge, tangential_stiffness=3e4,
                      normal_stiffness=4e4, friction_coefficient=0.4, preload=8.0)  # fmt: skip
cubic = CubicSpring(name="cubic", direction=between(3, 0), stiffness=2e11)
joints, force = [rub, cubic], np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])  # 1 N cos(Omega t) on the first mass
# The static load balances the preload, so that the chain at rest is at zero.
system = JointedSystem(mass=M, damping=C, stiffness=K, joints=joints, static_load=8.0 * wedge, harmonic_force=force)
balance = HarmonicBalance(system=system, n_harmonic=10)

figure = Figure(figsize=(12, 4.6), layout="constrained", dpi=120)
response, loop, states = figure.subplots(1, 3)
for level in (0.02, 1.0, 2.5, 4.0):
    at_level = balance.at_level(level)
    curve = frequency_response(at_level, 2 * np.pi * 12, 2 * np.pi * 32)
    compliance = curve.amplitude(2) / level * 1e3
    peak = int(compliance.argmax())
    state = steady_state(at_level, curve.angular_frequency[peak], start=curve.start(at_level, peak))
    motion = contact_motion(at_level, state)[0]
    response.semilogy(curve.frequency, compliance, ".-", markersize=3, label=f"{level:g} N")
    closed = np.r_[-1 : balance.n_sample]  # a period ends where it began
    loop.plot(motion.displacement[0, closed] * 1e3, motion.force[0, closed])
    turns = int(np.count_nonzero(np.diff(np.sign(np.diff(curve.frequency)))))
    print(f"{level:4g} N: peak {compliance[peak]:.3f} mm/N at {curve.frequency[peak]:.2f} Hz, {turns} folds")

    # Energy balance of a period: work of the force = work of friction and damping, exactly in H harmonics.
    q, k = state.coefficients, np.arange(balance.n_harmonic)
    put_in = -np.pi * level * q[1, 0].imag
    damped = np.pi * state.angular_frequency * k**2 @ np.einsum("ki,ij,kj->k", q.conj(), C, q).real
    assert np.isclose(put_in, damped + motion.dissipated.sum(), rtol=1e-6)
    if level == 0.02:  # no slip: the first mode of the stuck chain, within the distance of the points
        K_stuck = K + rub.directions.T @ np.diag([rub.tangential_stiffness, rub.normal_stiffness]) @ rub.directions
        stuck = np.sqrt(np.linalg.eigvalsh(K_stuck)[0]) / (2 * np.pi)
        assert np.isclose(curve.frequency[peak], stuck, rtol=4e-3)

for name, share in zip(("stuck", "slipping", "separated"), curve.contact_share[:, 0].T, strict=True):
    states.plot(curve.frequency, share, ".-", markersize=3, label=name)
response.set(xlabel="frequency [Hz]", ylabel="amplitude of the last mass / force [mm/N]", title="response")
loop.set(xlabel="displacement [mm]", ylabel="friction force [N]", title="friction at the peaks")
states.set(xlabel="frequency [Hz]", ylabel="share of the period", title=f"contact at {level:g} N")
response.legend()
states.legend()
figure.savefig("forced_response.png")
print("drawn in forced_response.png")
