"""Every command takes every case; of one that lacks something it says in one sentence what, and how to add it."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from study import cli
from study.diagnose.history import read_text

TwoMasses = Callable[..., Path]
SWEEP = '[sweep]\nfrom = "20 Hz"\nto = "30 Hz"\n'
#: A table of the case of two masses, up to the next one.
TABLE = r"(?ms)^{}\n.*?(?=^\[|\Z)"
COMMANDS = {
    "solve": ("solve", "chain.toml", "--out", "out"),
    "limits": ("limits", "chain.toml", "--out", "out"),
    "compare": ("compare", "chain.toml", "campaign", "--out", "out"),
    "diagnose": ("diagnose", "chain.toml", "campaign", "--out", "out"),
    "reduce": ("reduce", "chain.toml", "--out", "out"),
    "modes": ("modes", "chain.toml", "--out", "out"),
    "add": ("add", "mass at tip", "--value", "5 g"),
}
Refused = Callable[[str], str]


@pytest.fixture
def refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Refused:
    """The one sentence with which a command refuses ``chain.toml``."""
    monkeypatch.setattr("study.modes.run.require_egl", lambda: None)

    def run(command: str) -> str:
        capsys.readouterr()
        before = read_text(Path("chain.toml"))
        assert cli.main([*COMMANDS[command], "--quiet"]) == 2
        message = capsys.readouterr().err
        assert message.count("\n") == 1, message
        assert re.match(r"chain\.toml:\d+: ", message), message
        assert read_text(Path("chain.toml")) == before
        return message

    return run


def without(case: Path, table: str) -> None:
    text, n = re.subn(TABLE.format(re.escape(table)), "", read_text(case))
    assert n >= 1
    case.write_text(text, encoding="utf-8")


@pytest.mark.parametrize("command", ["solve", "limits"])
def test_no_sweep(two_masses: TwoMasses, refused: Refused, command: str) -> None:
    two_masses({})
    assert re.search(r"there is no \[sweep\], .*: add one, e.g. with from = ", refused(command))


@pytest.mark.parametrize("command", ["solve", "limits", "compare", "diagnose"])
def test_no_load(two_masses: TwoMasses, refused: Refused, command: str) -> None:
    case = two_masses({})
    case.write_text(read_text(case) + SWEEP, encoding="utf-8")
    without(case, "[[load]]")
    assert re.search(r"\[\[load\]\] is missing, so nothing vibrates: add one", refused(command))


@pytest.mark.parametrize("command", ["solve", "limits"])
def test_no_sensor(two_masses: TwoMasses, refused: Refused, command: str) -> None:
    case = two_masses({})
    case.write_text(read_text(case) + SWEEP, encoding="utf-8")
    without(case, "[[sensor]]")
    assert re.search(r"\[\[sensor\]\] is missing, so nothing is shown: add one", refused(command))


def test_no_sensor_is_no_lack_where_the_campaign_has_them(two_masses: TwoMasses) -> None:
    without(two_masses({}), "[[sensor]]")
    assert cli.main([*COMMANDS["compare"], "--quiet"]) == 0


def test_no_joint_that_slides(two_masses: TwoMasses, refused: Refused) -> None:
    case = two_masses({})
    case.write_text(read_text(case) + SWEEP, encoding="utf-8")
    assert re.search("response limits cannot be computed", refused("limits"))


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("reduce", r"`stickslip reduce` .* case of plain matrices: .* give kind = \"matrices\""),
    ],
)
def test_nothing_to_do_with_plain_matrices(two_masses: TwoMasses, refused: Refused, command: str, said: str) -> None:
    line = read_text(two_masses({})).splitlines().index("[structure]") + 1
    message = refused(command)
    assert message.startswith(f"chain.toml:{line}: ")
    assert re.search(said, message)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_case_of_schema_1_says_what_to_change(two_masses: TwoMasses, refused: Refused, command: str) -> None:
    case = two_masses({})
    case.write_text(
        "schema = 1\n" + read_text(case).replace("schema = 2\n", "").replace("[structure]", "[model]"), encoding="utf-8"
    )
    message = refused(command)
    assert message.startswith("chain.toml:1: schema = 1: ")
    for remedy in ("schema = 2", "[structure]", "[[joint]]", "[[sensor]]", "[harmonics]", "docs/case.md"):
        assert remedy in message


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ('kind = "plain"', 'kind = "plane"', r'structure.kind = "plane": must be "blade", .*; did you mean "plain"\?'),
        ('kind = "plain"\n', "", r'structure.kind is missing; add kind = "plain"'),
        ('kind = "plain"', "kind = 3", r"structure.kind = 3: must be text in quotes"),
        ("[[place]]", '[structure.damper]\nradius = "6 mm"\n[[place]]', r"structure.damper: unknown table"),
        ("[[place]]", '[structure.mesh]\nsize = "2 mm"\n[[place]]', r"structure.mesh: unknown table"),
        ('kind = "plain"', 'kind = "matrices"', r'structure.file: unknown key.*"files"\?'),
        ("[structure]", "[structures]", r"\[structure\] is missing; add it, .* did you mean it by \[structures\]"),
        ("[[load]]", "[[contact]]", r"contact: unknown key; did you mean"),
        ("[[sensor]]", "[[output]]", r"output: unknown key"),
        ("highest = 3", "highest = 3\n[harmonic]", r'harmonic: unknown table; did you mean "harmonics"\?'),
    ],
)
def test_what_a_case_of_the_kind_does_not_have_is_named(
    two_masses: TwoMasses, capsys: pytest.CaptureFixture[str], right: str, wrong: str, said: str
) -> None:
    case = two_masses({})
    case.write_text(read_text(case).replace(right, wrong, 1), encoding="utf-8")
    assert cli.main([*COMMANDS["solve"], "--quiet"]) == 2
    lines = capsys.readouterr().err.splitlines()
    result = [line for line in lines if re.search(said, line)]
    assert result, lines
    number = re.match(r"chain\.toml:(\d+): ", result[0])
    assert number
    assert 1 <= int(number[1]) <= read_text(case).count("\n")


@pytest.mark.parametrize("command", ["solve", "limits", "compare", "diagnose", "reduce", "modes"])
def test_a_mesh_study_is_sent_to_its_command(
    two_masses: TwoMasses, refused: Refused, case_text: dict[str, str], command: str
) -> None:
    two_masses({}).write_text(case_text["coarse"], encoding="utf-8")
    assert re.search("the case of a mesh study: run it with `stickslip table1`", refused(command))


def test_the_mesh_study_refuses_a_case_of_one_structure(
    two_masses: TwoMasses, capsys: pytest.CaptureFixture[str]
) -> None:
    two_masses({})
    assert cli.main(["table1", "chain.toml", "--out", "out", "--quiet"]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "chain.toml: this is the case of one structure: give a mesh study, with [[model]] tables" in message
