"""Bands that were measured apart have axes of their own on the pages, as `correlation.feature.gap` finds them."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from correlation.feature.gap import find_gaps
from study.page.html import BAND_AXES

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="no node here (apt-get install nodejs)")


def run(folder: Path, ending: str, *values: object) -> Any:
    assert NODE is not None
    script = folder / "bands.js"
    script.write_text(BAND_AXES.read_text(encoding="utf-8") + ending, "utf-8")
    done = subprocess.run([NODE, str(script), json.dumps(values)], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


@pytest.mark.parametrize("seed", range(20))
def test_bands_end_at_the_gaps(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    step = random.uniform(0.5, 1.0, 30) * np.where(random.random(30) < 0.1, 40.0, 1.0)
    frequency = 100 + np.cumsum(step)
    print_bands = "console.log(JSON.stringify(findBands(JSON.parse(process.argv[2])[0])));"
    expected = [band.tolist() for band in np.split(frequency, find_gaps(frequency) + 1)]
    assert run(tmp_path, print_bands, frequency.tolist()) == expected


def test_levels_that_differ_a_little_in_frequency_share_their_bands(tmp_path: Path) -> None:
    grid = np.array([*np.linspace(112, 154, 15), *np.linspace(705, 735, 7)])
    curves = [(grid + 1e-3 * number).tolist() for number in range(3)]
    print_bands = "console.log(JSON.stringify(joinBands(JSON.parse(process.argv[2])[0])));"
    assert [band[2] for band in run(tmp_path, print_bands, curves)] == [45, 21]


@pytest.mark.parametrize("x", [
    [*np.linspace(112, 154, 15), *np.linspace(705, 735, 7)],
    [*np.arange(100.0, 401.0), *np.arange(410.0, 501.0)],  # a gap narrower than the room beside a band
])  # fmt: skip
def test_each_point_is_on_the_axis_of_its_band_once(tmp_path: Path, x: list[float]) -> None:
    points = {"mode": "markers", "x": x, "y": x, "error_y": {"array": x}}
    print_split = "console.log(JSON.stringify(splitBands(...JSON.parse(process.argv[2]))));"
    split = run(tmp_path, print_split, [points], {"xaxis": {"title": {"text": "frequency [Hz]"}}})
    assert [trace["xaxis"] for trace in split["traces"]] == ["x", "x2"]
    for key in ("x", "y"):
        assert [value for trace in split["traces"] for value in trace[key]] == x
    assert [value for trace in split["traces"] for value in trace["error_y"]["array"]] == x
    first, second = (split["layout"][name]["domain"] for name in ("xaxis", "xaxis2"))
    assert first[0] == 0
    assert first[1] < second[0]
    assert second[1] == pytest.approx(1)
    one = run(tmp_path, print_split, [{**points, "x": x[:15], "y": x[:15]}], {"xaxis": {}})
    assert list(one["layout"]) == ["xaxis"]
