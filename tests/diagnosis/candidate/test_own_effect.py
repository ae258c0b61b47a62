"""Effects from files and entry points: at home everywhere, and one sentence for each mistake."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from correlation.model import Model
from diagnosis.candidate.catalogue import list_effects
from diagnosis.candidate.effect import EffectError
from diagnosis.candidate.user_effect import read_effects

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
    effect = list_effects(bench, extra=[written(tmp_path, GOOD)]).effect("louder exciter")
    assert (effect.kind, effect.parameters[0].typical) == ("exciter gain", 1.1)
    np.testing.assert_allclose(effect.apply(bench, [2.0]).system.dynamic, 2 * bench.system.dynamic)


def test_an_effect_of_a_file_is_at_home_in_other_processes(bench: Model, tmp_path: Path) -> None:
    effect = list_effects(bench, extra=[written(tmp_path, GOOD)]).effect("louder exciter")
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
    before = list_effects(bench, extra=[written(tmp_path, GOOD)]).effect("louder exciter")
    after = list_effects(bench, extra=[written(tmp_path, GOOD.replace("1.1", "1.2"))]).effect("louder exciter")
    assert (before.parameters[0].typical, after.parameters[0].typical) == (1.1, 1.2)
    stored = pickle.dumps(before)
    assert pickle.loads(stored).parameters[0].typical == 1.1
    monkeypatch.delitem(sys.modules, type(before.effect).__module__)  # another process
    with pytest.raises(EffectError, match="stored with another version of the file"):
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
        ("x = 1\n", r"own\.py defines no effects: .* give it a function `candidates\(model\)`"),
        ("candidates = 3\n", r"own\.py defines no effects"),
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
        (GOOD.replace("return model.with", "model.with"), r"returns a NoneType: return a changed model"),
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
    with pytest.raises(EffectError, match="is not a Python file of effects: give the path of one"):
        read_effects(tmp_path / name)


def test_an_effect_that_fails_later_says_where(bench: Model, tmp_path: Path) -> None:
    text = GOOD.replace("        return model", "        assert values[0] < 1.5, 'too loud'\n        return model")
    effect = list_effects(bench, extra=[written(tmp_path, text)]).effect("louder exciter")
    with pytest.raises(EffectError, match=r"own\.py, line 16: `apply` of .* fails with AssertionError \(too loud\)"):
        effect.apply(bench, [1.8])


KIND = """

from diagnosis.effect import EFFECTS, EffectKind

def on_model(model, size):
    return candidates(model)

EFFECTS.register(
    EffectKind(
        name="exciter gain", acts_on="the exciter", physics=Louder.physics, signature=Louder.signature,
        parameters={"factor": ("-",)}, candidates=on_model,
    )
)
"""


def test_a_file_that_registers_a_kind_counts_where_it_is_named_alone(bench: Model, tmp_path: Path) -> None:
    file = written(tmp_path, GOOD + KIND)
    assert "louder exciter" in list_effects(bench, extra=[file]).names
    assert "louder exciter" in list_effects(bench, extra=[file]).names  # read again: nothing is registered twice
    assert "louder exciter" not in list_effects(bench).names
    effect = list_effects(bench, extra=[file]).effect("louder exciter")
    assert pickle.loads(pickle.dumps(effect)).apply(bench, [2.0]).system.dynamic.max() == 2.0


def test_a_kind_without_a_fact_or_with_the_name_of_another_is_refused(tmp_path: Path) -> None:
    with pytest.raises(EffectError, match=r"own\.py, line \d+: it fails with TypeError .*'acts_on'"):
        read_effects(written(tmp_path, GOOD + KIND.replace('acts_on="the exciter", ', "")))
    with pytest.raises(EffectError, match=r'own\.py, line \d+: .*"mass" is already registered in .*mass\.py'):
        read_effects(written(tmp_path, GOOD + KIND.replace('name="exciter gain"', 'name="mass"')))
    with pytest.raises(EffectError, match=r'own\.py, line \d+: .*"exciter gain" has physics = .*: say it in words'):
        read_effects(written(tmp_path, GOOD + KIND.replace("physics=Louder.physics", 'physics=""')))


def installed(tmp_path: Path, value: str) -> str:
    """What a process finds beside whose packages one with an entry point is installed."""
    (tmp_path / "my_effects.py").write_text(GOOD + KIND, encoding="utf-8")
    about = tmp_path / "mine-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n", encoding="utf-8")
    (about / "entry_points.txt").write_text(f"[stickslip.effects]\nown = {value}\n", encoding="utf-8")
    script = (
        "import runpy; made = runpy.run_path('tests/diagnosis/conftest.py'); bench = made['make_bench'](); "
        "from diagnosis.candidate.catalogue import list_effects; found = list_effects(bench); print(len(found.names)); "
        "effect = found.effect('louder exciter'); print(effect.apply(bench, [2.0]).system.dynamic.max().real)"
    )
    paths = os.pathsep.join([str(tmp_path), str(ROOT)])
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": paths},
    )  # fmt: skip
    return done.stdout + done.stderr


def test_an_installed_package_offers_effects(tmp_path: Path) -> None:
    assert installed(tmp_path, "my_effects").endswith("\n2.0\n")


def test_a_broken_entry_point_is_left_out_in_one_sentence(tmp_path: Path) -> None:
    said = installed(tmp_path, "no_such_package.effects")
    assert "a kind of effect is not used:" in said
    assert "ModuleNotFoundError: No module named 'no_such_package'" in said
    # All others are there.
    assert 'there is no effect "louder exciter": there are ' in said
