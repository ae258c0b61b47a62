"""The logarithmic axis and the map of the pages: no curve is cut off, no numbers lie on each other."""

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from figure.misfit_map import COLOUR_STEPS
from study.page.html import COMMON, LOG_SCALE

NODE = shutil.which("node")
PRINT = """
const [measured, predicted] = JSON.parse(process.argv[2]), scale = logAxis(measured, predicted);
console.log(JSON.stringify([scale && scale.axis.range, predicted.map((curve) => within(scale, curve))]));
"""


def run_script(folder: Path, ending: str, *values: object) -> Any:
    """What a script prints after those that all pages share."""
    assert NODE is not None
    script = folder / "axis.js"
    script.write_text("".join(file.read_text(encoding="utf-8") for file in (LOG_SCALE, COMMON)) + ending, "utf-8")
    words = [NODE, str(script), json.dumps(values)]
    return json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)


def log_axis(folder: Path, measured: list[list[float | None]], predicted: list[list[float | None]]) -> Any:
    """Range of the axis, and the predicted curves as they are drawn."""
    return run_script(folder, PRINT, measured, predicted)


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


@pytest.mark.skipif(NODE is None, reason="no node here (apt-get install nodejs)")
@pytest.mark.parametrize("span", [0.3, 1.0, 2.0, 4.0])
def test_an_axis_has_whole_numbers_at_any_span(tmp_path: Path, span: float) -> None:
    ending = """
const [range] = JSON.parse(process.argv[2]);
console.log(JSON.stringify(logTicks(range, label)));
"""
    low = math.log10(0.021)
    ticks = run_script(tmp_path, ending, [low, low + span])
    assert 3 <= len(ticks["tickvals"]) <= 8
    assert [float(text.replace(",", "")) for text in ticks["ticktext"]] == pytest.approx(ticks["tickvals"])


@pytest.mark.skipif(NODE is None, reason="no node here (apt-get install nodejs)")
@pytest.mark.parametrize("rows", [1, 4, 12, 40, 200])
def test_the_numbers_of_a_scale_have_room_beside_any_number_of_rows(tmp_path: Path, rows: int) -> None:
    ending = """
const [steps, rows] = JSON.parse(process.argv[2]);
console.log(JSON.stringify([mapHeight(rows) - MAP_MARGIN.t - MAP_MARGIN.b, mapBar(steps, rows).len]));
"""
    height, share = run_script(tmp_path, ending, COLOUR_STEPS, rows)
    # Seven numbers of 12 pixels each, and the words along them, of some 115 pixels.
    assert height * share > max(len(COLOUR_STEPS) * 1.2 * 12, 115)
    assert share <= 1
