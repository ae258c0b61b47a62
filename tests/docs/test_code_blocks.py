"""Code of the documentation runs as it stands.

That of other pages is run by the tests of what it is about: test_diagnose_document.py, test_record_document.py,
test_own_part_document.py, test_campaign_document.py, test_joint_law.py, test_tutorial.py, test_case_model.py.
"""

import re
import textwrap
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from reduction.jointed_system import CubicSpring, JointedSystem
from study.case.setup import read_case
from study.shipped_cases import LIMITS, SOLVE
from tests.slow import slow
from tests.study.rubbing_mass import CASE, write_matrices

ROOT = Path(__file__).parents[2]
SYSTEM = JointedSystem(
    mass=np.eye(2), damping=np.eye(2), stiffness=[[2e4, -1e4], [-1e4, 1e4]], harmonic_force=[[0, 0], [1, 0]],
    joints=[CubicSpring(name="cubic", direction=np.array([0.0, 1.0]), stiffness=1e9)],
)  # fmt: skip


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def fenced(page: str, language: str) -> list[str]:
    """Blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)```", text_of(page), re.MULTILINE | re.DOTALL)


def run(code: str, page: str, **names: object) -> dict[str, object]:
    space = dict(names)
    exec(compile(code, page, "exec"), space)
    return space


def test_the_python_of_the_readme_follows_a_curve_to_its_end(capsys: pytest.CaptureFixture[str]) -> None:
    section = text_of("README.md").split("## In Python\n")[1].split("\n## ")[0]
    block = re.search(r"(?:^ {4}.*\n|^\n(?= {4}))+", section, re.MULTILINE)
    assert block is not None
    space = run(textwrap.dedent(block.group()), "README.md")
    curve = space["curve"]
    assert "REACHED" in str(curve.stop_reason)  # type: ignore[attr-defined]
    assert capsys.readouterr().out


def test_the_first_block_of_harmonic_balance_saves_a_curve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run(fenced("docs/harmonic_balance.md", "python")[0], "docs/harmonic_balance.md")
    assert (tmp_path / "curve.nc").is_file()


def test_energies_and_a_backbone_of_a_case_are_those_of_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    block = text_of("docs/harmonic_balance.md").split("## Energies and backbone of a case\n")[1].split("```")[1]
    code = block.removeprefix("python").replace('"my.toml"', repr(str(SOLVE)))
    space = run(code, "docs/harmonic_balance.md")
    energy = space["energy"]
    np.testing.assert_allclose(energy.dissipated, energy.input_work, rtol=1e-6)  # type: ignore[attr-defined] # residual
    assert "wall" in capsys.readouterr().out


def test_matrices_are_exported_as_the_page_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run(fenced("docs/matrices.md", "python")[1], "docs/matrices.md", system=SYSTEM, pi=np.pi)
    assert (tmp_path / "structure.mat").is_file()
    assert (tmp_path / "structure.json").is_file()


@slow
def test_limits_of_a_wedge_damper_are_found_and_saved_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (block,) = fenced("docs/response_limits.md", "python")
    # Fewer frequencies and levels, at the resonance of the shipped case.
    block = block.replace("np.linspace(174, 198, 60), [1, 3, 5, 10]", "np.array([265.0, 283.0]), [1]")
    model = read_case(LIMITS).setup.model
    space = run(block, "docs/response_limits.md", system=model.system, TIP=model.sensors[0].row)
    limits = space["limits"]
    assert (limits.lower < limits.upper).all()  # type: ignore[attr-defined]
    assert (tmp_path / "limits.nc").is_file()
    assert capsys.readouterr().out


@slow
def test_sweeps_and_spreads_in_python_are_those_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    section = text_of("docs/uncertain.md").split("## In Python\n")[1]
    block = re.search(r"(?:^ {4}.*\n|^\n(?= {4}))+", section, re.MULTILINE)
    assert block is not None
    write_matrices(tmp_path)
    sweep = '[sweep]\nfrom = "155 Hz"\nto = "175 Hz"\nstep = "1 Hz"\nlevels = [1]\n'
    uncertain = '[[uncertain]]\nparameter = "mu"\ndistribution = "normal"\nmean = 1\nsd = 0.05\n'
    (tmp_path / "my.toml").write_text(CASE + sweep + uncertain, encoding="utf-8")
    code = textwrap.dedent(block.group()).replace("draws=64", "draws=4")
    space = run(code, "docs/uncertain.md")
    assert len(space["swept"].sampled.curves.curves) == 15  # type: ignore[attr-defined]


def dmig(name: str, matrix: dict[tuple[int, int, int], float]) -> str:
    """Nastran's cards of a symmetric matrix in free fields, by node, node and direction."""
    lines = [f"DMIG,{name},0,6,2,0"]
    lines += [f"DMIG,{name},{column},{axis},,{row},{axis},{value:.6E}" for (column, row, axis), value in matrix.items()]
    return "\n".join(lines) + "\n"


def test_nastrans_matrices_are_reduced_as_the_page_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    nodes, axes = (1, 2, 3, 20, 31), (1, 2, 3)
    mass = {(node, node, axis): 1.0 for node in nodes for axis in axes}
    chain = list(pairwise(nodes))
    stiffness = {(node, node, axis): 2e4 for node in nodes for axis in axes}
    stiffness |= {(first, second, axis): -1e4 for first, second in chain for axis in axes}
    Path("model.pch").write_text(dmig("MAAX", mass) + dmig("KAAX", stiffness))
    rom = run(fenced("docs/matrices.md", "python")[0], "docs/matrices.md")["rom"]
    # Nodes 20 and 31 move, in three directions alike: k - c and k + c over 1 kg.
    squared = scipy.linalg.eigvalsh(rom.stiffness, rom.mass)  # type: ignore[attr-defined]
    np.testing.assert_allclose(squared, [1e4] * 3 + [3e4] * 3, rtol=1e-9)  # nothing is left out; round-off


def test_the_effect_of_ones_own_is_the_example_word_for_word() -> None:
    (block,) = fenced("docs/own_effect.md", "python")
    assert block == text_of("examples/effects/exciter_third_harmonic.py")
    (table,) = fenced("docs/own_effect.md", "toml")
    assert tomllib.loads(table) == {"effects": {"files": ["my_effect.py"]}}


def test_the_tables_of_limits_are_valid_in_a_case(tmp_path: Path) -> None:
    from study.kind.registry import open_case

    (block,) = fenced("docs/limits_of_a_case.md", "toml")
    case = tmp_path / "my.toml"
    case.write_text(f'schema = 2\n[structure]\nkind = "plain"\nfile = "my.npz"\n{block}', encoding="utf-8")
    opened = open_case(case).case
    assert opened.limits.reach == 5e-6
    assert opened.sweep.levels == (1, 3, 10)
