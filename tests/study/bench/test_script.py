"""Each click as a command, as Python and in a script that runs."""

import ast
import shlex
from pathlib import Path

import pytest

from study.bench.script import ScriptEntry, format_command, format_python, format_script

CASE, FOLDER = Path("my beam.toml"), Path("campaign")


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (ScriptEntry(name="compare", arguments={}, numbers={}), ["compare", "my beam.toml", "campaign"]),
        (
            ScriptEntry(name="diagnose", arguments={}, numbers={}),
            ["diagnose", "my beam.toml", "campaign", "--without", "gap", "air damping"],
        ),
        (
            ScriptEntry(name="add", arguments={"effect": "mass at tip", "values": ["93 mg"], "seen": "a1"}, numbers={}),
            ["add", "mass at tip", "--case", "my beam.toml", "--value", "93 mg"],
        ),
        (ScriptEntry(name="undo", arguments={"seen": "a1"}, numbers={}), ["undo", "--case", "my beam.toml"]),
    ],
)
def test_a_click_is_a_command_that_the_shell_reads_back(entry: ScriptEntry, words: list[str]) -> None:
    assert shlex.split(format_command(entry, CASE, FOLDER, ("gap", "air damping"))) == ["stickslip", *words]


def test_several_steps_back_are_as_many_commands() -> None:
    entry = ScriptEntry(name="undo", arguments={"count": 3}, numbers={})
    assert format_command(entry, Path("a.toml"), FOLDER).split("; ") == ["stickslip undo --case a.toml"] * 3


def test_python_leaves_out_what_the_page_alone_needs() -> None:
    entry = ScriptEntry(name="add", arguments={"effect": "mass at tip", "values": [], "seen": "a1"}, numbers={})
    assert format_python(entry) == "bench.add(effect='mass at tip')"


def test_a_script_holds_the_case_letter_by_letter() -> None:
    text = "title = \"'''\\n{}\"\n# ü\r\n"
    entries = [ScriptEntry(name="edit", arguments={"text": text}, numbers={})]
    tree = ast.parse(format_script(entries, CASE, FOLDER, ("gap",), text, "", {"own.py": "'\n"}))
    constants = {
        node.targets[0].id: ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Name)
        and not isinstance(node.value, ast.Call)
    }
    assert constants == {"TEXT": text, "HISTORY": "", "WITHOUT": ("gap",), "EFFECTS": {"own.py": "'\n"}}
    assert text in {node.value for node in ast.walk(tree.body[-1]) if isinstance(node, ast.Constant)}


def test_a_script_of_nothing_runs() -> None:
    compile(format_script([], CASE, FOLDER, (), "", ""), "script.py", "exec")
