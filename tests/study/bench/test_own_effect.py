"""Effects of one's own on the bench: tried before they are saved, named by the case, and never run without trust."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from geometry.errors import InputError
from study.bench.bench import Bench
from study.bench.case_text import hash_text, list_effect_files, with_effect_files
from study.bench.own_effect import write_template
from study.bench.script import ScriptEntry, format_script
from study.case.setup import read_case
from study.case.trust import UntrustedCode, trusting
from study.diagnose.history import read_text
from study.json_value import to_json
from tests.study.conftest import TwoMasses


@pytest.fixture
def bench(two_masses: TwoMasses, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Bench:
    """The bench of two masses without a hidden effect."""
    case = two_masses({})
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "stored"))
    return Bench(case, Path("campaign").resolve())


def template(bench: Bench) -> str:
    return write_template(read_case(bench.case).setup.model)


def test_the_template_runs_and_its_effect_is_a_candidate(bench: Bench) -> None:
    text, drawn = template(bench), read_text(bench.case)
    answer = bench.save_effect("mine.py", text, seen=hash_text(drawn), before="")
    assert answer.numbers == {"offers": "own spring at base"}
    assert (bench.case.parent / "mine.py").read_text(encoding="utf-8") == text
    assert list_effect_files(read_text(bench.case)) == ["mine.py"]
    assert read_text(bench.case).startswith(drawn.rstrip())
    assert [(item["name"], item["text"]) for item in answer.views["own"]["files"]] == [("mine.py", text)]
    rows = bench.screen().views["candidates"]["rows"]
    assert "own spring at base" in [row["name"] for row in rows]


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("def candidates(model: Model)", "def candidates(model: Model", "SyntaxError"),
        ("model.places[PLACE]", "model.places['nowhere']", "nowhere"),
        ("PLACE = 'base'", "PLACE = 1 / 0", "division"),
    ],
)
def test_a_mistake_is_a_sentence_with_its_line_and_nothing_is_written(
    bench: Bench, old: str, new: str, word: str
) -> None:
    text, drawn = template(bench), read_text(bench.case)
    wrong = text.replace(old, new)
    assert wrong != text
    before = sorted(bench.case.parent.iterdir())
    with pytest.raises(InputError, match=word) as error:
        bench.save_effect("mine.py", wrong)
    line = text[: text.index(old)].count("\n") + 1
    assert f"{bench.case.parent / 'mine.py'}, line {line}:" in str(error.value)
    assert "\n" not in str(error.value)
    assert (read_text(bench.case), sorted(bench.case.parent.iterdir())) == (drawn, before)


@pytest.mark.parametrize("name", ["../mine.py", "/tmp/mine.py", "mine.txt", ".mine.py", "a/mine.py", "", "m ine.py"])
def test_a_name_that_is_none_of_the_folder_is_refused(bench: Bench, name: str) -> None:
    with pytest.raises(InputError, match=re.escape(f'"{name}"')):
        bench.save_effect(name, template(bench))
    assert list_effect_files(read_text(bench.case)) == []


def test_a_file_that_the_case_does_not_name_is_not_written_over(bench: Bench) -> None:
    other = bench.case.parent / "other.py"
    other.write_text("print('a program of the user')\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"other\.py"):
        bench.save_effect("other.py", template(bench))
    assert other.read_text(encoding="utf-8").startswith("print")


def test_a_file_that_was_edited_since_it_was_shown_is_not_written_over(bench: Bench) -> None:
    text = template(bench)
    bench.save_effect("mine.py", text)
    file = bench.case.parent / "mine.py"
    file.write_text(text + "# by hand\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"mine\.py"):
        bench.save_effect("mine.py", text + "# in the page\n", before=hash_text(text))
    assert file.read_text(encoding="utf-8").endswith("# by hand\n")


def test_an_effect_that_the_case_has_cannot_be_taken_away(bench: Bench) -> None:
    text = template(bench)
    bench.save_effect("mine.py", text)
    bench.add("own spring at base", ["2 N/m"])
    with pytest.raises(InputError, match="own spring at base"):
        bench.save_effect("mine.py", text.replace("own spring at", "other spring at"))
    assert (bench.case.parent / "mine.py").read_text(encoding="utf-8") == text


def test_where_others_may_write_no_source_runs_without_trust(bench: Bench) -> None:
    text, ran = template(bench), bench.case.parent / "ran"
    bench.case.parent.chmod(0o777)
    telling = f"open({str(ran)!r}, 'w').close()\n"
    with pytest.raises(UntrustedCode, match="--trust"):
        bench.save_effect("mine.py", text + telling)
    assert not ran.exists()
    assert not (bench.case.parent / "mine.py").exists()
    with trusting():
        bench.save_effect("mine.py", text + telling)
    assert ran.exists()


def test_a_script_leaves_the_files_of_the_user_alone_and_gives_the_same_numbers(
    bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    drawn, text, entries = read_text(bench.case), template(bench), []
    file = bench.case.parent / "mine.py"
    bench.save_effect("mine.py", text)
    first, named = text, read_text(bench.case)

    def done(name: str, **arguments: Any) -> None:
        result = getattr(bench, name)(**arguments)
        entries.append(ScriptEntry(name=name, arguments=arguments, numbers=result.numbers))

    done("screen")
    done("save_effect", file="mine.py", text=text.replace("own spring at", "soft spring at"))
    done("save_effect", file="other.py", text=text.replace("own spring at", "other spring at"))
    done("add", effect="soft spring at base", values=["2 N/m"])
    done("edit", text=read_text(bench.case) + "# mine\n")
    done("compare")
    done("undo")
    # What the user does with her files after that is nothing to the script.
    file.write_text("not python", encoding="utf-8")
    (bench.case.parent / "other.py").unlink()
    left = sorted(bench.case.parent.iterdir())
    script = format_script(entries, bench.case, bench.folder, (), named, "", {"mine.py": first})
    exec(compile(script, "again.py", "exec"), {"__name__": "__main__"})
    printed = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert printed == [to_json(entry.numbers) for entry in entries]
    assert file.read_text(encoding="utf-8") == "not python"
    assert [item for item in sorted(bench.case.parent.iterdir()) if item.name != "stored"] == [
        item for item in left if item.name != "stored"
    ]
    assert drawn != named


@pytest.mark.parametrize(
    "text",
    [
        "schema = 2\n",
        "schema = 2\n[effects]\nwithout = ['gap'] # mine\n\n[noise]\nx = 1\n",
        'schema = 2\r\n[effects]\r\nfiles = [\r\n  "a.py", # the first\r\n]\r\n',
        "\ufeffeffects = {files = ['a.py']}\nschema = 2\n",
        "effects.files = ['a.py']\n[structure]\nkind = 'plain'",
    ],
)
def test_a_name_is_added_and_all_else_of_the_case_stays(text: str) -> None:
    files = [*list_effect_files(text), "own.py"]
    after = with_effect_files(text, files)
    assert list_effect_files(after) == files
    kept = [line for line in text.splitlines() if "a.py'" not in line]
    assert all(line in after.splitlines() for line in kept)
    assert after.startswith("\ufeff") == text.startswith("\ufeff")
    assert ("\r\n" in after) == ("\r\n" in text)
