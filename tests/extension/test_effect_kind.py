"""A kind of effect, added by one file outside the product, passes what every kind must."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from correlation.model import Model
from diagnosis.candidate.catalogue import list_effects
from diagnosis.effect import EFFECTS, EffectKind
from geometry.errors import RegistryError
from tests.diagnosis import conftest
from tests.diagnosis.effect import test_effect
from tests.extension.sweep import sweeps

FILE = Path(__file__).with_name("part_modulus.py")

bench, paper, small = conftest.bench, conftest.paper, conftest.small


@pytest.fixture(scope="module")
def effect_kind() -> Iterator[EffectKind]:
    """The kind; the other tests of this process do without it."""
    (result,) = EFFECTS.load(FILE)
    yield result
    EFFECTS.forget(FILE)


@pytest.fixture(scope="module")
def planted_kind(effect_kind: EffectKind) -> EffectKind:
    return effect_kind


globals().update(sweeps("effect_kind", test_effect))
globals().update(sweeps("planted_kind", test_effect))


def test_it_stands_in_the_list_of_all(effect_kind: EffectKind, bench: Model) -> None:
    result = list_effects(bench)
    assert result.kinds[-1] == effect_kind.name == "modulus"
    assert result.effect("modulus of stand").physics == effect_kind.physics
    assert "modulus" not in list_effects(bench, without=["modulus"]).kinds


def test_a_file_without_a_fact_is_refused_in_a_sentence(tmp_path: Path) -> None:
    file = tmp_path / "half.py"
    file.write_text(FILE.read_text(encoding="utf-8").replace("        physics=Modulus.physics,\n", ""))
    with pytest.raises(RegistryError, match=r"half\.py, line \d+: .*lacks physics .*: add it"):
        EFFECTS.load(file)
    assert file not in EFFECTS.outside_files()
