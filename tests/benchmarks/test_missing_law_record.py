"""Records of the benchmark of missing laws have what its score and a continued run read."""

from types import SimpleNamespace
from typing import Any

import pytest

from benchmarks.missing_law.__main__ import run


def test_a_record_without_a_law_names_its_seed_and_what_was_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    trial = SimpleNamespace(
        hidden=SimpleNamespace(kind="play"), n_contact=3, model=SimpleNamespace(sensors=[None] * 4), harmonics=(1,),
        campaign=None,
    )  # fmt: skip
    arrangement = SimpleNamespace(fit=SimpleNamespace(chi2=6.0, n_number=3))
    stubs: dict[str, Any] = {
        "benchmarks.missing_law.campaign.make": trial,
        "diagnosis.fit.arrangement.arrange": arrangement,
        "diagnosis.fit.calibration_parameter.list_calibration_parameters": [],
        "diagnosis.missing_law.recover.recover_law": None,
    }
    for target, result in stubs.items():
        monkeypatch.setattr(target, lambda *_, result=result, **__: result)
    record = run(7)
    assert (record["seed"], record["kind"], record["law"], record["chi2"]) == (7, "play", False, 2.0)
    assert (record["contacts"], record["sensors"]) == (3, 4)
