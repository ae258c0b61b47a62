"""From a CAD blade to a Craig-Bampton model: geometry, mesh, matrices, reduction, and a check."""

from pathlib import Path

import stickslip as ss

blade = ss.Blade()  # lengths in metres; see docs/blade.md for every dimension
ss.write_step(ss.blade_part(blade), Path("blade.step"))

rule = ss.MeshRule(element=ss.HEX20, through_thickness=1, length_ratio=4.0, length_cap=0.012)
mesh = ss.mesh_blade(blade, rule)
mass, stiffness = ss.assemble(mesh, ss.STEEL)
system = ss.supported_system(mesh, mass, stiffness, [ss.Support(nodes=mesh.nodes("clamp"))])

names = ("excitation", "response", "contact_positive", "contact_negative")
boundary = {name: system.rows(mesh.node_sets[name]) for name in names}
ss.save_rom(ss.craig_bampton(system, boundary, n_mode=100), "blade_rom.h5")
rom = ss.load_rom("blade_rom.h5")

full, reduced = ss.modes(system, 5).frequency, rom.modes(5).frequency
print(f"{system.n_dof} degrees of freedom reduced to {rom.n_dof}")
for number, (f, r) in enumerate(zip(full, reduced, strict=True), start=1):
    print(f"mode {number}: full {f:10.4f} Hz, reduced {r:10.4f} Hz, error {r / f - 1:.1e}")

# Rayleigh's principle: a reduced model is never softer; 1e-8 is a margin for the eigenvalue solver's round-off.
assert (reduced > full * (1 - 1e-8)).all()
assert (reduced < full * (1 + 1e-6)).all()
