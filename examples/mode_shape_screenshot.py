"""An off-screen picture of a mode shape, and a check of its frequency against beam theory."""

from math import pi, sqrt

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX20
from fe.material import STEEL
from fe.mesher.mesh_rule import MeshRule
from fe.mesher.plain_blade import mesh_plain_blade
from fe.modal import modes
from fe.stress import compute_nodal_stress, compute_von_mises
from figure.scene.mode_picture import ModeColour, mode_picture
from geometry.plain_blade import PlainBlade

bar = PlainBlade(length=0.3)  # metres; long, so that beam theory applies
mesh = mesh_plain_blade(bar, MeshRule(element=HEX20, through_thickness=2, length_ratio=2.4, length_cap=0.005))
mass, stiffness = assemble(mesh, STEEL)
system = supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes("clamp"))])
first_mode = modes(system, 1)

shape = system.on_mesh(first_mode.mode_shapes)[:, :, 0]
stress = compute_von_mises(compute_nodal_stress(mesh, STEEL, shape))
frequency = float(first_mode.frequency[0])
colour = ModeColour(field="von_mises", values=stress)
mode_picture(mesh, shape, "mode1.png", frequency=frequency, title="Mode 1")
mode_picture(mesh, shape, "stress1.png", frequency=frequency, title="Mode 1", colour=colour)

beam = 1.8751**2 / (2 * pi) * sqrt(STEEL.young * bar.thickness**2 / (12 * STEEL.density)) / bar.length**2
print(f"mode 1: {frequency:.3f} Hz; clamped-free beam: {beam:.3f} Hz; pictures: mode1.png, stress1.png")

# The root block is slightly compliant, the clamp of the theory is rigid: about the thickness over the length, 2 %.
assert 0.96 * beam < frequency < beam
