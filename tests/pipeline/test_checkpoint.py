"""An unfinished computation as one file: found again by its key alone, whole or not at all."""

from pathlib import Path

import numpy as np

from pipeline.checkpoint import Checkpoint


def test_what_was_saved_is_loaded_bit_by_bit_and_the_last_one_counts(tmp_path: Path) -> None:
    file = tmp_path / "curve.part"
    points = np.random.default_rng(5).standard_normal((4, 3)) + 1j
    checkpoint = Checkpoint(file, "key")
    assert checkpoint.load() is None
    checkpoint.save({"points": np.zeros(2)})
    checkpoint.save({"points": points, "step": 0.1})
    result = Checkpoint(file, "key").load()
    np.testing.assert_array_equal(result["points"], points)
    assert result["step"] == 0.1
    assert [item.name for item in tmp_path.iterdir()] == ["curve.part"]
    checkpoint.remove()
    checkpoint.remove()
    assert checkpoint.load() is None


def test_a_checkpoint_of_other_inputs_or_a_damaged_one_is_not_found(tmp_path: Path) -> None:
    file = tmp_path / "curve.part"
    Checkpoint(file, "key").save([1.0, 2.0])
    assert Checkpoint(file, "other").load() is None
    whole = file.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"", whole.replace(b"list", b"tsil")):
        file.write_bytes(damaged)
        told: list[str] = []
        assert Checkpoint(file, "key", told.append).load() is None
        assert told == [f"{file} is damaged; its content will be computed again"]


def test_offers_are_saved_once_the_time_has_passed(tmp_path: Path) -> None:
    now = 0.0
    checkpoint = Checkpoint(tmp_path / "curve.part", "key", every=1.0, clock=lambda: now)
    saved = []
    for tenth in range(25):
        now = tenth / 10
        checkpoint.save_if_due(tenth)
        saved.append(checkpoint.load())
    assert saved[9] is None
    assert saved[10] == saved[19] == 10
    assert saved[24] == 20
