"""What docs/time_records.md says can be run."""

import contextlib
import io
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from correlation.campaign.time_record import TimeRecord
from correlation.model import Model, Sensor
from correlation.time_record.prediction import predict_record, prepare_drive
from diagnosis.candidate.place import with_cubic_spring
from reduction.jointed_system import JointedSystem
from tests.slow import slow

DOCUMENT = Path(__file__).parents[2] / "docs" / "time_records.md"
ONE = np.ones(1)


def record(model: Model, *, held_out: bool) -> TimeRecord:
    """The model's own answer to smooth noise; the fit has no error but in what it does not know."""
    rng = np.random.default_rng(2 + held_out)
    time = np.arange(1500) / 400.0
    force = np.convolve(rng.normal(size=1540), np.hanning(41), "valid")
    run = TimeRecord(
        name="shaken", time=time, channels=("force", "tip"), units=("N", "V"), values=np.stack([force, time]),
        force="force", held_out=held_out,
    )  # fmt: skip
    result = predict_record(model, prepare_drive(run))
    assert result is not None
    return TimeRecord(
        name=run.name, time=time, channels=run.channels, units=run.units, values=np.vstack([force, result]),
        force="force", held_out=held_out,
    )  # fmt: skip


@slow
def test_the_example_finds_what_is_hidden() -> None:
    system = JointedSystem(mass=[[1.0]], damping=[[4.0]], stiffness=[[4e3]], harmonic_force=[[0.0], [1.0]])
    bench = Model(system=system, sensors=(Sensor(name="tip", row=ONE, gain=100.0),), places={"tip": ONE})
    truth = with_cubic_spring(bench, "hidden", ONE, 2e7).with_sensor("tip", gain=103.0)
    campaign = SimpleNamespace(records=(record(truth, held_out=False), record(truth, held_out=True)))
    (block,) = re.findall(r"```python\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        exec(block, {"bench": bench, "campaign": campaign})
    assert told.getvalue().startswith("cubic at tip (2e+07 N/m^3 +- ")
