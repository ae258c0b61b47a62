"""The logarithmic axis of the pages: no curve is cut off at its ends."""

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import study.page

NODE = shutil.which("node")
COMMON = Path(study.page.__file__).with_name("common.js")
PRINT = """
const [measured, predicted] = JSON.parse(process.argv[2]), scale = logAxis(measured, predicted);
console.log(JSON.stringify([scale && scale.axis.range, predicted.map((curve) => within(scale, curve))]));
"""


def log_axis(folder: Path, measured: list[list[float | None]], predicted: list[list[float | None]]) -> Any:
    """Range of the axis, and the predicted curves as they are drawn."""
    assert NODE is not None
    script = folder / "axis.js"
    script.write_text(COMMON.read_text(encoding="utf-8") + PRINT, encoding="utf-8")
    words = [NODE, str(script), json.dumps([measured, predicted])]
    return json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)


@pytest.mark.skipif(NODE is None, reason="no node here (apt-get install nodejs)")
def test_an_axis_holds_all_that_is_drawn(tmp_path: Path) -> None:
    measured: list[list[float | None]] = [[1.0, 0.2, None], [3.0]]
    (low, high), drawn = log_axis(tmp_path, measured, [[0.03, None, 7.0, 1e-17]])
    # 1e-17 is a model without this harmonic.
    assert drawn == [[0.03, None, 7.0, None]]
    assert low < math.log10(0.03)
    assert high > math.log10(7.0)
    assert high - low < math.log10(7.0 / 0.03) + 0.2


@pytest.mark.skipif(NODE is None, reason="no node here (apt-get install nodejs)")
def test_without_amplitudes_there_is_no_logarithmic_axis(tmp_path: Path) -> None:
    assert log_axis(tmp_path, [[None, 0.0]], [[0.0]]) == [None, [[0.0]]]
