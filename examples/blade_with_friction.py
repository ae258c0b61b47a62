"""The rig's blade rubbing in both of its slots: geometry, mesh, reduction, friction contacts, response, and a check."""

import numpy as np
from matplotlib.figure import Figure
from scipy.linalg import eigh

from fe.assembly import assemble_compact
from fe.boundary import Support, supported_system
from fe.damping import rayleigh_damping
from fe.element import HEX20
from fe.material import STEEL
from fe.mesher.blade import mesh_blade
from fe.mesher.mesh_rule import MeshRule
from geometry.blade import Blade, contact_lines
from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.continuation.response import frequency_response
from hbsolve.steady_state import steady_state
from reduction.craig_bampton import craig_bampton
from reduction.jointed_system import FrictionContact, JointedSystem, along

# Stiffnesses of a contact line [N/m] and friction, after the paper. The load [N per line] is a tenth of the rig's. Here
# the slots touch the rigid ground instead of dampers, and under the full load no contact would slip.
TANGENTIAL, NORMAL, FRICTION, LOAD = 4.65e6, 6.75e6, 0.6, 3.0
LEVELS = (1.0, 3.0, 5.0, 10.0)  # N

blade = Blade()
mesh = mesh_blade(blade, MeshRule(element=HEX20, through_thickness=1, length_ratio=4.0, length_cap=0.012))
free = supported_system(mesh, *assemble_compact(mesh, STEEL), [Support(nodes=mesh.nodes("clamp"))])
names = ("excitation", "response", "contact_positive", "contact_negative")
rom = craig_bampton(free, {name: free.rows(mesh.node_sets[name]) for name in names}, n_mode=40)

joints, static_load = [], np.zeros(rom.n_dof)
for name, line in contact_lines(blade).items():
    for station, dofs in enumerate(rom.rows(name).reshape(-1, 3)):
        share = line.tributary_length[station] / line.tributary_length.sum()
        normal, *tangents = (
            along(rom.n_dof, dict(zip(dofs.tolist(), direction, strict=True)))
            for direction in (line.normal[station], *line.tangents[station])
        )
        contact = FrictionContact(
            name=f"{name} {station}", normal=normal, tangents=np.array(tangents), preload=share * LOAD,
            tangential_stiffness=share * TANGENTIAL, normal_stiffness=share * NORMAL, friction_coefficient=FRICTION,
        )  # fmt: skip
        joints.append(contact)
        static_load += share * LOAD * normal  # balances the preload; without it the contact would push the blade away

B = np.vstack([joint.directions for joint in joints])
D = np.concatenate([[joint.tangential_stiffness] * 2 + [joint.normal_stiffness] for joint in joints])
K_stuck = rom.stiffness + B.T @ (D[:, None] * B)
stuck = float(np.sqrt(eigh(K_stuck, rom.mass, eigvals_only=True)[0]) / (2 * np.pi))
damping = rayleigh_damping(0.002, stuck)
force = np.zeros((2, rom.n_dof))
force[1, rom.rows("excitation", 1)] = 1.0
system = JointedSystem(
    mass=rom.mass, damping=damping.mass_factor * rom.mass + damping.stiffness_factor * K_stuck, stiffness=rom.stiffness,
    joints=joints, static_load=static_load, harmonic_force=force,
)  # fmt: skip
balance, tip = HarmonicBalance(system=system, n_harmonic=6), int(rom.rows("response", 1)[0])

figure = Figure(figsize=(12, 8), layout="constrained", dpi=120)
(response, states), (loop, forces) = figure.subplots(2, 2)
frequency, ratio = [], []
for level in LEVELS:
    at_level = balance.at_level(level)
    curve = frequency_response(at_level, 2 * np.pi * 0.96 * stuck, 2 * np.pi * 1.02 * stuck)
    top = int(curve.amplitude(tip).argmax())
    near = int(np.abs(curve.frequency - stuck).argmin())
    state = steady_state(at_level, 2 * np.pi * stuck, start=curve.start(at_level, near))
    motion = contact_motion(at_level, state)[0]
    frequency.append(curve.frequency[top])
    ratio.append(curve.amplitude(tip)[top] / level * 1e6)
    print(f"{level:4g} N: peak at {frequency[-1]:.2f} Hz, {ratio[-1]:.3f} um/N")
    response.plot(curve.frequency, curve.amplitude(tip) / level * 1e6, ".-", markersize=3, label=f"{level:g} N")
    states.plot(curve.frequency, 1 - curve.contact_share[:, :, 0].mean(axis=1), ".-", markersize=3)
    closed = np.r_[-1 : balance.n_sample]  # a period ends where it began
    loop.plot(motion.displacement[0, closed] * 1e6, motion.force[0, closed])
    forces.plot(motion.time * stuck, motion.force[0] / motion.force[-1])
response.axvline(stuck, color="grey", linestyle=":", label="stuck")
response.legend()
response.set(xlabel="frequency [Hz]", ylabel="tip amplitude / force [µm/N]", title="response")
states.set(xlabel="frequency [Hz]", ylabel="mean share of the period", title="contacts that are not stuck")
loop.set(xlabel="displacement [µm]", ylabel="T [N]", title=f"{joints[0].name}, at {stuck:.1f} Hz")
forces.set(xlabel="time / period", ylabel="T / N [-]", title=f"{joints[0].name}, at {stuck:.1f} Hz")
figure.savefig("blade_with_friction.png")
print(f"stuck resonance {stuck:.2f} Hz; drawn in blade_with_friction.png")

# Under a small force no contact slips: the peak is that of the stuck blade, within the distance of the points. Under a
# large force contacts slip: the blade softens, and friction damps it.
assert abs(frequency[0] / stuck - 1) < 1e-3
assert frequency[-1] < 0.998 * stuck
assert ratio[-1] < 0.5 * ratio[0]
