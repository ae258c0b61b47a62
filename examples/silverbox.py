"""A measured electronic oscillator, all in volts: the effect that a linear model of its record lacks.

python examples/silverbox.py FOLDER     # has SNLS80mV.csv; or set STICKSLIP_DATA, with silverbox/SNLS80mV.csv
"""

import os
import sys
from pathlib import Path

import numpy as np

from correlation.campaign.time_record import TimeRecord
from correlation.time_record.single_dof import fit_single_dof
from diagnosis.effect.density import Density
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.time_record.arrangement import about_mean, stretch
from diagnosis.time_record.diagnose import record_rounds

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(os.environ.get("STICKSLIP_DATA", ".")) / "silverbox"
file = folder / "SNLS80mV.csv"
if not file.is_file():
    print(
        f"{file} is not there. Download the Silverbox files from https://www.nonlinearbenchmark.org/benchmarks/silverbox,"
    )
    print("unpack them, and give the folder of SNLS80mV.csv: python examples/silverbox.py FOLDER")
    sys.exit()

# V1 is the input, V2 the output; first growing noise (the arrow), then ten multisines of 8,692 samples.
values = np.loadtxt(file, delimiter=",", skiprows=1, usecols=(0, 1)).T
time = np.arange(values.shape[1]) / (1e7 / 2**14)
whole = TimeRecord(name="all", time=time, channels=("V1", "V2"), units=("V", "V"), values=values, force="V1")
whole = about_mean(whole)  # without the offset of the generator
records = [
    stretch(whole, 40550, 49200, name="first multisine", held_out=False),
    stretch(whole, 57934, 66584, name="third multisine", held_out=True),
    stretch(whole, 0, 40495, name="arrow", held_out=True),
]
base = fit_single_dof(records[0], "V2")  # initial values of mass, damping and stiffness from the spectra
factors = [
    *list_calibration_parameters(base),
    Density(name="density of all", part="all"),
]  # of damping, stiffness and mass

rounds = record_rounds(base, records, factors, run_in=0.5, units={"N": "V", "m": "V"})
for number, diagnosis in enumerate(rounds, 1):
    print(f"Round {number}. {diagnosis.verdict.sentence}")
    for refit in diagnosis.refits:
        held = ", ".join(f"{100 * error:.2f} %" for error in refit.held_out_errors)
        print(f"  {refit.effect.name:22} held-out errors {held}")
    for score in diagnosis.scores:
        if not score.gain:
            print(f"  {score.effect.name:22} is absorbed by the fitted parameters")
print(rounds[-1].verdict.smallest)

best = rounds[0].verdict.effects[0]
assert best.effect.kind == "cubic"
assert (best.held_out_errors < rounds[0].baseline.held_out_errors / 5).all()
