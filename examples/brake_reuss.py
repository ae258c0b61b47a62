"""A bolted beam, measured by others: what a linear model of its first mode misses as the level rises.

python examples/brake_reuss.py FOLDER     # has ForcedFrequencyResponses.mat; or set STICKSLIP_DATA, with brb_forced/
"""

import os
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from study.compare.run import run_compare
from study.run_context import silent_run

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(os.environ.get("STICKSLIP_DATA", ".")) / "brb_forced"
file = folder / "ForcedFrequencyResponses.mat"
if not file.is_file():
    print(f"{file} is not there. Download it from https://github.com/mattiacenedese/BRBtesting, and give its folder:")
    print("python examples/brake_reuss.py FOLDER")
    sys.exit()

# The manifest says what the columns of the MATLAB file are; it stands beside the file.
work = Path(mkdtemp())
shutil.copy(file, work)
for name in ("campaign.toml", "beam.toml"):
    shutil.copy(Path(__file__).parent / "measured" / "brake_reuss" / name, work)

# One mode: 2 kg at the accelerometer make its response at the lowest level.
mass, frequency, ratio = 2.0, 80.35, 0.0015
omega = 2 * np.pi * frequency
np.savez(work / "beam.npz", M=[[mass]], K=[[mass * omega**2]], C=[[2 * ratio * omega * mass]])

compared = run_compare(work / "beam.toml", work, replace(silent_run(), output=work))
print("level [N]   frequency [Hz]   damping ratio [%]")
for peak in compared.peaks:
    print(f"{peak.level:9.3f}   {peak.frequency:14.3f}   {100 * peak.damping:17.3f}")
print("\n".join(map(str, compared.files)))

damping = [peak.damping for peak in compared.peaks]
assert max(damping) > 3 * min(damping)
