"""Matrices from files: a beam as MatrixMarket and Harwell-Boeing, reduced, with friction, and exported to NLvib."""

from pathlib import Path

import numpy as np
import scipy.io
from matplotlib.figure import Figure

from fe.file.imported_matrices import Units, read_matrices
from fe.file.matrix_file import MatrixSource
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import frequency_response
from reduction.craig_bampton import craig_bampton
from reduction.jointed_system import JenkinsElement, JointedSystem, between
from reduction.nlvib import save_nlvib

# Files as from another program: a clamped beam in mm, tonne and N, 20 elements, z and roty of nodes 1 to 21.
length, n, EI, line_mass = 400.0, 20, 210e3 * 10.0**4 / 12, 7.8e-9 * 10.0**2
h, rotates = length / n, np.array([0, 1, 0, 1])  # the four rows of an element
unit = h ** (rotates[:, None] + rotates)
K_element = EI / h**3 * unit * [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]
M_element = line_mass * h / 420 * unit * [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
K, M = np.zeros((2, 2 * n + 2, 2 * n + 2))
for element in (slice(first, first + 4) for first in range(0, 2 * n, 2)):
    K[element, element] += K_element
    M[element, element] += M_element
scipy.io.hb_write("stiffness.hb", scipy.sparse.csc_array(K))
scipy.io.mmwrite("mass.mtx", scipy.sparse.coo_array(M), symmetry="symmetric", precision=17)
rows = "".join(f"{row},{row // 2 + 1},{('z', 'roty')[row % 2]}\n" for row in range(2 * n + 2))
Path("dofs.csv").write_text(f"dof,node,direction\n{rows}", encoding="utf-8")

# Import and reduction (or `stickslip reduce`, docs/matrices.md).
files = MatrixSource(file=Path("mass.mtx")), MatrixSource(file=Path("stiffness.hb"))
beam = read_matrices(*files, dofs=Path("dofs.csv"), units=Units.MILLIMETRE)
clamp, tip = beam.dofs.rows([1], range(6)), beam.dofs.rows([n + 1], [2])
free = beam.system(fixed=clamp)
rom = craig_bampton(free.linear, {"tip": free.row[tip]}, n_mode=8)
modes, roots = rom.modes(3), np.array([1.875104069, 4.694091133, 7.854757438])  # cosh b cos b = -1
exact = (roots / length) ** 2 * np.sqrt(EI / line_mass) / (2 * np.pi)
print("computed:", modes.frequency.round(3), "Hz, theory:", exact.round(3), "Hz")
assert np.abs(modes.frequency / exact - 1).max() < 1e-4  # elements and truncation together
# A spring and slider at the tip: stuck at 0.02 N, sliding at 1 N, nearly free at 10 N.
slider = JenkinsElement(name="slider", direction=between(rom.n_dof, 0), tangential_stiffness=4e3, limit_force=1.0)
C, force = 2e-5 * rom.stiffness, np.eye(2, rom.n_dof, k=-1)  # 1 N cos(Omega t) on the tip
system = JointedSystem(mass=rom.mass, damping=C, stiffness=rom.stiffness, joints=[slider], harmonic_force=force)
save_nlvib(system, "beam_for_nlvib.mat")
figure = Figure(figsize=(10, 4.2), layout="constrained", dpi=120)
shape, response = figure.subplots(1, 2)
deflection = rom.displacement(modes.mode_shapes)[: n + 1, 2]
names = [f"{f:.1f} Hz" for f in modes.frequency]
shape.plot(np.linspace(0, length, n + 1), deflection / deflection[-1], ".-", label=names)
for level in (0.02, 1.0, 10.0):
    curve = frequency_response(HarmonicBalance(system=system, n_harmonic=6).at_level(level), 250.0, 700.0)
    response.semilogy(curve.frequency, curve.amplitude(0) / level * 1e6, ".-", markersize=3, label=f"{level:g} N")
shape.set(
    ylim=(-0.8, 1.25),
    xlabel="position [mm]",
    ylabel="deflection / that of the tip",
    title="reduced beam, back on all nodes",
)
response.set(xlabel="frequency [Hz]", ylabel="amplitude / force [µm/N]", title="tip with a slider of 1 N")
shape.legend(loc="upper center", ncols=3)
response.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), title="force")
figure.savefig("import_matrices.png")
print("drawn in import_matrices.png")
