"""Tables of sweeps: a step that would take days is a mistake."""

import pytest
from pydantic import ValidationError

from study.case.sweep_table import MOST_POINTS, FrequencySweepTable, LevelSweepTable

LEVELS = {"parameter": "level", "from": 1.0, "to": 10.0, "frequencies": ["1 Hz"]}


@pytest.mark.parametrize("step", ["5e-324 Hz", "1e-4 Hz"])
def test_a_step_of_more_points_than_any_curve_has_is_refused(step: str) -> None:
    with pytest.raises(ValidationError, match=str(MOST_POINTS)):
        FrequencySweepTable.model_validate({"from": "130 Hz", "to": "50 Hz", "step": step})
    with pytest.raises(ValidationError, match=str(MOST_POINTS)):
        LevelSweepTable.model_validate(
            {"parameter": "level", "from": 1.0, "to": 10.0, "step": 1e-12, "frequencies": ["1 Hz"]}
        )


def test_a_fine_step_is_taken() -> None:
    assert FrequencySweepTable.model_validate({"from": "50 Hz", "to": "130 Hz", "step": "0.001 Hz"}).step == 0.001
