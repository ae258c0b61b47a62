"""What is stored of source files is what they say now, whatever the store holds."""

import json
from pathlib import Path

import pytest

from pipeline import source_facts as module
from pipeline.source_facts import FILE, FORMAT, find_source_facts


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path))
    monkeypatch.setattr(module, "_save_at_exit", lambda: None)
    forget()
    yield tmp_path
    forget()


def forget() -> None:
    module._read_stored.cache_clear()
    find_source_facts.cache_clear()


def test_an_edited_file_has_other_facts_and_a_comment_has_not(store: Path) -> None:
    file = store / "code.py"
    facts = []
    for text in ("import a\nX = 1\n", "import a  # why\nX = 1\n", "import b\nX = 1\n"):
        file.write_text(text)
        find_source_facts.cache_clear()
        facts.append(find_source_facts(file))
    assert facts[0] == facts[1]
    assert facts[0].code != facts[2].code
    assert facts[2].modules == ("b",)


@pytest.mark.parametrize("content", ["", "{", "[]", '{"format": "0"}', '{"format": 1, "facts": {"a": [1]}}'])
def test_a_damaged_store_is_passed_over(store: Path, content: str) -> None:
    (store / FILE).write_text(content)
    file = store / "code.py"
    file.write_text("from a.b import c\n")
    assert find_source_facts(file).names == (("a.b", ("c",)),)


def test_stored_facts_are_used(store: Path) -> None:
    file = store / "code.py"
    file.write_text("import a\n")
    result = find_source_facts(file)
    (key,) = module._read_stored()
    facts = {key: ["stored", ["a"], [], []]}
    stored = {"format": FORMAT, "sha256": module._compute_checksum(facts), "facts": facts}
    (store / FILE).write_text(json.dumps(stored))
    forget()
    assert find_source_facts(file) == result._replace(code="stored")
    # A result may depend on a file that a changed byte leaves out.
    (store / FILE).write_text(json.dumps(stored).replace('["a"]', '["b"]'))
    forget()
    assert find_source_facts(file) == result
