"""A kept step comes back equal, and reading one runs no code that is not the product's or a read effect file's."""

import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

from diagnosis.candidate.own_effect import read_effects
from diagnosis.threshold.thresholds import Thresholds
from study.case.setup import read_case
from study.diagnose.codec import STEP, STEP_FILE
from study.shipped import BEAM

OWN = Path(__file__).parents[2] / "examples" / "effects" / "exciter_third_harmonic.py"


def there_and_back(value: object, folder: Path) -> object:
    STEP.save(value, folder)
    return STEP.load(folder)


def test_arrays_models_and_own_effects_come_back(tmp_path: Path) -> None:
    model = read_case(BEAM).setup.model
    back = there_and_back(
        {"model": model, "list": [1 + 2j, np.float64(3), {4}], "limits": Thresholds(gain=1, misfit=2)}, tmp_path
    )
    assert isinstance(back, dict)
    np.testing.assert_array_equal(back["model"].system.mass, model.system.mass)
    assert back["list"] == [1 + 2j, 3.0, {4}]
    assert back["limits"] == Thresholds(gain=1, misfit=2)
    (effect,) = read_effects(OWN).candidates(model)
    again = there_and_back(effect, tmp_path)
    assert again.name == effect.name  # type: ignore[attr-defined,union-attr]


class Harm:
    def __init__(self, function: object, *arguments: object) -> None:
        self._reduced = (function, arguments)

    def __reduce__(self):  # type: ignore[no-untyped-def]
        return self._reduced


def _named(name: str) -> bytes:
    """A pickle that calls a function by its name, as an attacker would write it."""
    module, _, function = name.rpartition(":")
    return (
        b"\x80\x04\x8c"
        + bytes([len(module)])
        + module.encode()
        + b"\x8c"
        + bytes([len(function)])
        + function.encode()
        + b"\x93\x8c\x02id\x85R."
    )


@pytest.mark.parametrize(
    "raw",
    [
        pickle.dumps(Harm(subprocess.Popen, ["true"])),
        pickle.dumps(Harm(exec, "1")),
        _named("os:system"),
        _named("pipeline.output:os.system"),
        _named("study.diagnose.codec:pickle.loads"),
        _named("correlation.campaign.read_campaign:read_campaign"),
        b"no pickle",
        b"",
    ],
)  # fmt: skip
def test_what_has_no_place_in_a_step_is_taken_for_damaged(tmp_path: Path, raw: bytes) -> None:
    (tmp_path / STEP_FILE).write_bytes(raw)
    with pytest.raises(ValueError, match="a kept step cannot be read"):
        STEP.load(tmp_path)


def test_an_own_effect_cannot_hide_another_class(tmp_path: Path) -> None:
    from diagnosis.candidate import own_effect

    hidden = Harm(own_effect._restored, str(OWN), _named("os:system"))
    STEP.save(hidden, tmp_path)
    with pytest.raises(ValueError, match="a kept step cannot be read"):
        STEP.load(tmp_path)
