"""A format of test files, added by one file outside the product, is read like the product's own."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from correlation.errors import CampaignError
from correlation.file.format import MEASURED_FILES
from correlation.file.read_file import read_file
from geometry.errors import RegistryError

FILE = Path(__file__).with_name("bin_file.py")
VALUES = np.array([[0.0, 1.5], [0.1, -2.5], [0.2, 3.5]])


@pytest.fixture(autouse=True)
def bench_format() -> Iterator[None]:
    """The format; the other tests of this process do without it."""
    MEASURED_FILES.load(FILE)
    yield
    MEASURED_FILES.forget(FILE)


@pytest.mark.parametrize("name", ["run.bench", "run.dat"])
def test_its_files_are_recognised_by_content_and_read(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"BENCH time acc\n" + VALUES.tobytes())
    measured = read_file(path)
    assert measured.format == "bench"
    np.testing.assert_array_equal(measured.column("acc").values, VALUES[:, 1])


def test_its_refusals_and_its_failures_are_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.bench"
    path.write_bytes(b"BENCH time acc\n" + VALUES.tobytes()[:-3])
    with pytest.raises(CampaignError, match=r"run\.bench: 45 bytes are no rows of 2 channels"):
        read_file(path)
    monkeypatch.setitem(vars(MEASURED_FILES["bench"]), "read", lambda _: 1 / 0)
    with pytest.raises(CampaignError, match=r'reader "bench" \(bin_file\.py\) fails with ZeroDivisionError'):
        read_file(path)


def test_a_format_without_a_dot_in_its_suffix_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text(
        FILE.read_text().replace('(".bench",)', '("bench",)').replace('"bench"', '"b2"', 1)
    )
    with pytest.raises(
        RegistryError, match=r"bad\.py, line \d+: .*(give lower-case ones with their dot|is already registered)"
    ):
        MEASURED_FILES.load(tmp_path / "bad.py")
