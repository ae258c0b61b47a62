"""From a STEP file of another CAD system to a reduced model: tetrahedra, named faces, a rim of stations, a check."""

from math import pi, sqrt, tan
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from fe.assembly import assemble_compact
from fe.boundary import Support, supported_system
from fe.material import STEEL
from fe.mesher.tetrahedra import TetRule, mesh_solid
from fe.modal import modes
from fe.station_coordinates import make_station_coordinates
from fe.surface_line import line_along_edge
from figure.scene.mode_picture import mode_picture
from figure.scene.named_faces import named_faces_picture
from geometry.face_selector import FaceSelector
from geometry.step_part import step_part
from reduction.craig_bampton import craig_bampton
from reduction.file.rom_hdf5 import save_rom

# A screw, drawn in Euclid in 1998 (parts/README.md); `stickslip reduce parts/screw.toml` does the same and more.
x, y, tip_z, seat_z, radius = -17.898e-3, -0.826e-3, -34.564e-3, 0.436e-3, 5e-3
faces = {
    "shank": [FaceSelector(at=(x + radius, y, -16e-3))],
    "seat": [FaceSelector(area=(315e-6, 316e-6))],  # [m^2]
    "slot": [FaceSelector(normal=(0, 0, 1))],
    "tip": [FaceSelector(normal=(0, 0, -1))],
}
part = step_part(Path(__file__).parent / "parts" / "screw.step", faces)
mesh = mesh_solid(part, TetRule(size=5e-3, near={"slot": 3e-3}))
# The rim under the head may rub on a plate: eight stations on it are retained, independent of the nodes.
rim = line_along_edge(mesh, "rim", ("seat", "shank"), n_station=8)
place = make_station_coordinates(mesh, {"rim": rim.stations}, {"rim": "seat"}, fixed=["tip"])
mass, stiffness = assemble_compact(mesh, STEEL)
held = [Support(nodes=mesh.nodes("tip"))]
system = supported_system(mesh, place.matrix(mass), place.matrix(stiffness), held)
rom = craig_bampton(system, {"rim": system.rows(place.mesh.node_sets["rim"])}, n_mode=20)
save_rom(rom, "screw_rom.h5")
full, reduced = modes(system, 6).frequency, rom.modes(6).frequency
for number, (f, r) in enumerate(zip(full, reduced, strict=True), start=1):
    print(f"mode {number}: full {f:10.2f} Hz, reduced {r:10.2f} Hz, error {r / f - 1:.1e}")
assert (np.abs(reduced / full - 1) < 1e-3).all()

named_faces_picture(mesh, mesh.face_sets, rim.stations, "screw_faces.png", title="Screw")
shape = system.on_mesh(place.displacement(system, rom.recovery @ rom.modes(1).mode_shapes))[..., 0]
mode_picture(mesh, shape, "screw_mode1.png", frequency=float(reduced[0]), title="Mode 1")
print("drawn in screw_faces.png and screw_mode1.png")

# Torsion of a rod with the head as a flywheel: b tan b = inertia of the rod / of the head, b = omega L / c.
turn = (mesh.points[:, [1, 0, 2]] - [y, x, 0]) * [-1, 1, 0] * (mesh.points[:, 2:] > seat_z - 1e-9)
ratio = STEEL.density * (seat_z - tip_z) * pi * radius**4 / 2 / (turn.ravel() @ (mass @ turn.ravel()))
b = brentq(lambda b: b * tan(b) - ratio, 1e-6, 1.57)
theory = b / (seat_z - tip_z) * sqrt(STEEL.young / (2 * (1 + STEEL.poisson)) / STEEL.density) / (2 * pi)
print(f"mode 3, torsion: {full[2]:.0f} Hz, a rod with a flywheel: {theory:.0f} Hz")
assert abs(full[2] / theory - 1) < 0.05  # the head is not a rigid disc, and the tip is chamfered
