"""The case files that come with stickslip."""

from pathlib import Path

CASES = Path(__file__).with_name("cases")
#: A model of the rig's blade.
BLADE = CASES / "blade.toml"
#: The whole rig: blade, dampers and de-couplers.
RIG = CASES / "rig.toml"
#: The mesh studies: the rig's blade first, the default if its rows are near enough to the published rows.
TABLE1 = (CASES / "table1_rig.toml", CASES / "table1_plain.toml")
#: The replay of the calibration of the paper.
PAPER = CASES / "paper.toml"
#: A chain of three masses whose end rubs on a wall; its matrices are in the same folder.
SOLVE = CASES / "solve_chain.toml"
#: A blade with a wedge damper: the smallest system whose response depends on friction history; matrices as above.
LIMITS = CASES / "wedge_damper.toml"
#: The beam of the virtual test bench, with its matrices in the same folder; `study.beam.case` writes both.
BEAM = CASES / "beam" / "beam.toml"
