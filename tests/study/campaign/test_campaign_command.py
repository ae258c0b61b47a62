"""``stickslip campaign new`` on the command line."""

import io
import json
from pathlib import Path

import numpy as np
import pytest

from study import cli


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    rows = [f"{f},{1 / (100.0**2 - f**2 + 2 * f)},0.1" for f in np.linspace(90, 110, 21)]
    (tmp_path / "frf.csv").write_text("\n".join(["f [Hz],acc re [m/s^2/N],acc im [m/s^2/N]", *rows]))
    return tmp_path


def test_what_was_understood_and_assumed_is_printed(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["campaign", "new", str(folder), "--yes"]) == 0
    out = capfd.readouterr().out
    assert "frequency responses" in out
    assert "m/s^2" in out
    assert "place = tip" in out
    assert f"stickslip compare CASE {folder}" in out
    assert "# assumed: " in (folder / "campaign.toml").read_text()
    assert cli.main(["campaign", "new", str(folder), "--yes"]) == 2
    assert "already exists" in capfd.readouterr().err
    assert cli.main(["campaign", "new", str(folder), "--yes", "--force", "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["manifest"].endswith("campaign.toml")


def test_without_a_terminal_somebody_must_say_yes(
    folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    assert cli.main(["campaign", "new", str(folder)]) == 2
    assert "add --yes" in capfd.readouterr().err
    assert not (folder / "campaign.toml").exists()


@pytest.mark.parametrize("n_sensor", [1, 2])
def test_places_that_are_assumed_for_several_sensors_come_before_a_comparison(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], n_sensor: int
) -> None:
    names = ["tip", "root"][:n_sensor]
    rows = [[f, *([1 / (100.0**2 - f**2 + 2 * f), 0.1] * n_sensor)] for f in np.linspace(90, 110, 21)]
    header = ["f [Hz]", *(f"acc {name} {part} [m/s^2/N]" for name in names for part in ("re", "im"))]
    lines = [",".join(header), *(",".join(map(str, row)) for row in rows)]
    (tmp_path / "frf.csv").write_text("\n".join(lines))
    assert cli.main(["campaign", "new", str(tmp_path), "--yes"]) == 0
    text = (tmp_path / "campaign.toml").read_text().splitlines()
    places = [str(number) for number, line in enumerate(text, start=1) if line.startswith("place = ")]
    (following,) = [line for line in capfd.readouterr().out.splitlines() if line.startswith("next: ")]
    assert (f"{tmp_path / 'campaign.toml'} (lines {', '.join(places)})" in following) == (n_sensor > 1)
    assert following.endswith(f"then stickslip compare CASE {tmp_path}")
