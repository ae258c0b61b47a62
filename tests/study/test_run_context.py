"""What a run of a command knows of runs before it."""

from pathlib import Path

import pytest

from pipeline.duration import Durations
from study.run_context import Options


def test_a_step_of_one_measured_folder_tells_no_time_of_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = Options(cache=tmp_path / "cache")
    place, file = tmp_path / "first", options.open().store.folder
    assert file is not None
    file.mkdir(parents=True, exist_ok=True)
    Durations(file / "durations.npz", place=str(place.resolve())).remember("read", 10.0)
    for name, known in (("first", True), ("second", False)):
        with options.open(place=tmp_path / name).progress.step("read"):
            pass
        assert ("about 10 s" in capsys.readouterr().err) == known
