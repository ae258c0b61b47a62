"""Effects from files and entry points: at home everywhere, and one sentence for each mistake."""

import importlib.metadata
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from correlation.model import Model
from diagnosis.candidate.catalogue import catalogue
from diagnosis.candidate.effect import EffectError
from diagnosis.candidate.own_effect import installed_effects, read_effects

ROOT = Path(__file__).parents[3]
OWN = ROOT / "examples" / "effects" / "exciter_third_harmonic.py"

GOOD = """
from dataclasses import dataclass
from diagnosis.candidate.effect import EffectParameter

PARAMETER = EffectParameter(name="factor", unit="-", lower=0.5, upper=2.0, typical=1.1, vanishes=1.0)

@dataclass(frozen=True)
class Louder:
    name: str = "louder exciter"
    kind: str = "exciter gain"
    physics: str = "The exciter pushes harder than it says."
    signature: str = "Everything is larger."
    parameters: tuple = (PARAMETER,)

    def apply(self, model, values):
        return model.with_system(harmonic_force=values[0] * model.system.dynamic)

def candidates(model):
    return [Louder()]
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "own.py"
    path.write_text(text, encoding="utf-8")
    return path


def test_an_effect_of_a_file_acts(bench: Model, tmp_path: Path) -> None:
    effect = catalogue(bench, extra=[written(tmp_path, GOOD)]).effect("louder exciter")
    assert (effect.kind, effect.parameters[0].typical) == ("exciter gain", 1.1)
    np.testing.assert_allclose(effect.apply(bench, [2.0]).system.dynamic, 2 * bench.system.dynamic)


def test_an_effect_of_a_file_is_at_home_in_other_processes(bench: Model, tmp_path: Path) -> None:
    effect = catalogue(bench, extra=[written(tmp_path, GOOD)]).effect("louder exciter")
    read_effects(tmp_path / "own.py")  # once more: the class must stay the one that it was
    stored = tmp_path / "effect.pickle"
    stored.write_bytes(pickle.dumps((effect, bench)))
    script = (
        "import pickle, sys; effect, bench = pickle.load(open(sys.argv[1], 'rb')); "
        "print(abs(effect.apply(bench, [3.0]).system.dynamic).max())"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(stored)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (0, "3.0\n"), done.stderr


def test_a_file_that_was_edited_is_read_again(bench: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = catalogue(bench, extra=[written(tmp_path, GOOD)]).effect("louder exciter")
    after = catalogue(bench, extra=[written(tmp_path, GOOD.replace("1.1", "1.2"))]).effect("louder exciter")
    assert (before.parameters[0].typical, after.parameters[0].typical) == (1.1, 1.2)
    stored = pickle.dumps(before)
    assert pickle.loads(stored).parameters[0].typical == 1.1
    monkeypatch.delitem(sys.modules, type(before.effect).__module__)  # another process
    with pytest.raises(EffectError, match="stored when the file was another"):
        pickle.loads(stored)


def test_the_shipped_file_is_what_it_says(bench: Model) -> None:
    (effect,) = read_effects(OWN).candidates(bench)
    force = effect.apply(bench, [0.2]).system.dynamic  # type: ignore[union-attr]
    np.testing.assert_allclose(force[3], 0.2 * bench.system.dynamic[1])
    assert read_effects(OWN).candidates(bench.with_system(harmonic_force=None)) == []


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("x = = 1\n", r"own\.py, line 1: it fails with SyntaxError"),
        ("import no_such_module_anywhere\n", r"own\.py, line 1: it fails with ModuleNotFoundError \(No module named"),
        ("import sys\nsys.exit(3)\n", r"own\.py, line 2: it fails with SystemExit \(3\)"),
        ("x = 1\n", r"own\.py offers no effects: give it a function `candidates\(model\)`"),
        ("candidates = 3\n", r"own\.py offers no effects"),
        ("def candidates(model):\n    return 1 / 0\n", r"own\.py, line 2: `candidates` fails with ZeroDivision"),
        ("def candidates():\n    return []\n", r"own\.py: `candidates` fails with TypeError"),
        ("def candidates(model):\n    pass\n", r"`candidates` returns a NoneType: return a list"),
        ("def candidates(model):\n    yield 1\n    raise KeyError('k')\n", r"line 3: `candidates` fails with Key"),
        ("def candidates(model):\n    return 'mass'\n", r"`candidates` returns a str: return a list of effects"),
        ("def candidates(model):\n    return [3]\n", r"the effect int has name = None: give it name, kind"),
        (GOOD.replace('"Everything is larger."', '""'), r"the effect Louder has signature = ''"),
        (GOOD.replace("(PARAMETER,)", "()"), r'the parameters of "louder exciter" are \(\): give a tuple of Effect'),
        (GOOD.replace("(PARAMETER,)", "(1.0,)"), r'the parameters of "louder exciter" are \(1\.0,\)'),
        (GOOD.replace("def apply", "def applied"), r'"louder exciter" has no method apply'),
        (GOOD.replace("values[0]", "values[1]"), r'line 16: `apply` of "louder exciter" fails with IndexError'),
        (GOOD.replace("return model.with", "model.with"), r"returns a NoneType: return a changed test model"),
        (GOOD.replace("harmonic_force=", "mass=").replace("dynamic", "mass + 1"), r"changes the mass at its vanishing"),
        (GOOD.replace("return model.with_system(", "return model\n("), r"line 17: it fails with Syn"),
        (
            GOOD.replace("return model.with_system(harmonic_force=values[0] * model.system.dynamic)",
                         "return model"),
            r"changes nothing at its typical values",
        ),
        (GOOD.replace("[Louder()]", "[Louder(parameters=(type('P', (PARAMETER.__class__,), {})(**vars(PARAMETER)),))]"),
         r'storing "louder exciter" for other processes fails'),
        (GOOD.replace("typical=1.1", "typical=3.0"), r"own\.py, line 5: it fails with EffectError \(factor: 1"),
    ],
)  # fmt: skip
def test_a_bad_file_is_refused_in_one_sentence(bench: Model, tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(EffectError, match=sentence) as caught:
        read_effects(written(tmp_path, text)).candidates(bench)
    assert str(caught.value).startswith(str(tmp_path / "own.py"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["missing.py", "own.txt", "."])
def test_what_is_no_python_file_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "own.txt").write_text(GOOD, encoding="utf-8")
    with pytest.raises(EffectError, match="is no Python file of effects: give the path of one"):
        read_effects(tmp_path / name)


def test_an_effect_that_fails_later_says_where(bench: Model, tmp_path: Path) -> None:
    text = GOOD.replace("        return model", "        assert values[0] < 1.5, 'too loud'\n        return model")
    effect = catalogue(bench, extra=[written(tmp_path, text)]).effect("louder exciter")
    with pytest.raises(EffectError, match=r"own\.py, line 16: `apply` of .* fails with AssertionError \(too loud\)"):
        effect.apply(bench, [1.8])


def entry_points(monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    point = importlib.metadata.EntryPoint(name="own", value=value, group="stickslip.effects")
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda group: [point] if group == point.group else [])


@pytest.mark.parametrize("value", ["diagnosis.effect.gain", "diagnosis.effect.gain:candidates"])
def test_an_installed_package_offers_effects(bench: Model, monkeypatch: pytest.MonkeyPatch, value: str) -> None:
    entry_points(monkeypatch, value)
    (source,) = installed_effects()
    assert [each.name for each in source.candidates(bench)] == ["gain of tip", "gain of left_T", "gain of left_N"]


def test_a_broken_entry_point_is_refused_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    entry_points(monkeypatch, "no_such_package.effects")
    with pytest.raises(
        EffectError, match=r"entry point own \(no_such_package\.effects\): it fails with ModuleNotFound"
    ):
        installed_effects()
