"""Every key of a document is found on the line where it was written, whatever stands around it."""

import tomllib
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from geometry.toml_position import Path, key_lines

# Values that look like structure to a careless reader; the multi-line ones move everything below them.
SCALARS = st.sampled_from(
    [
        "1", "-2.5e-3", "+inf", "nan", "true", "0xFF", "1979-05-27 07:32:00Z", "1979-05-27", "07:32:00.5",
        '"plain"', '"# no comment"', '"a = [1, {x"', r'"quote \" and \\"', "'[table]'", "''", '""', r"'C:\path\'",
        '"""one line"""', '"""two\nlines"""', '"""\n# [x]\ny = 3\n"""', "'''raw\n\n[[y]] = '' \n'''", '""""quoted""""',
        '"""ends in two quotes"""""', r'"""escaped \""" inside"""', "''''''", '""""""', '"""line \\\n   joined"""',
        "[]", "[ ]", "[1, 2, 3]", "[\n  1, # one ]\n  2,\n]", "{}", "{ a = 1, b.c = '}' }", "[[1], [2, [3]]]",
        '[{ x = 1 }, { x = "]" }]', "[\n  { a = 1 },\n\n  # {\n  { a = [1,\n 2] },\n]",
    ]
)  # fmt: skip
BARE_KEYS = st.sampled_from(["a", "b", "length", "E_modulus", "3", "-", "key-1"])
QUOTED_KEYS = st.sampled_from(['"a b"', "'x.y'", '"#"', r'"q\"uote"', '""', '"[z]"', '"é"', r'"\u00e9t\u00e9"'])
KEYS = BARE_KEYS | QUOTED_KEYS
GAPS = st.sampled_from(["", "", "\n", "# comment = 1\n", "  \t\n\n", "# [header] '''\n"])
BLANKS = st.sampled_from(["", " ", "  ", "\t"])
TAILS = st.sampled_from(["", " ", " # tail = 2 ]", "#'"])


def meant(key: str) -> str:
    """Return what a written key means, as tomllib understands it."""
    return next(iter(tomllib.loads(f"{key} = 1")))


@dataclass
class Draft:
    """A document under construction that notes the line of each key it writes."""

    text: str = ""
    lines: dict[Path, int] = field(default_factory=dict)

    @property
    def line(self) -> int:
        return self.text.count("\n") + 1

    def write(self, path: Path, text: str) -> None:
        self.lines[path] = self.line
        self.text += text


@st.composite
def documents(draw: st.DrawFn) -> Draft:
    """Tables and arrays of tables with unlike names, each with keys that may be dotted."""
    draft = Draft()

    def pairs(table: Path) -> None:
        for key in draw(st.lists(KEYS, max_size=4, unique_by=meant)):
            draft.text += draw(GAPS) + draw(BLANKS)
            blank = draw(BLANKS)
            dots = draw(st.lists(KEYS, max_size=2))
            written = f"{blank}.{blank}".join([key, *dots])
            path = table
            for part in (key, *dots):
                path = (*path, meant(part))
                draft.lines.setdefault(path, draft.line)
            draft.text += f"{written}{blank}={blank}{draw(SCALARS)}{draw(TAILS)}\n"

    pairs(())
    for number in range(draw(st.integers(0, 3))):
        draft.text += draw(GAPS)
        # No name of a table is one of a key above, so that the document is valid whatever is drawn.
        key, blank = f"T{number}", draw(BLANKS)
        if draw(st.booleans()):
            draft.write((key,), f"[{blank}{key}{blank}]{draw(TAILS)}\n")
            pairs((key,))
            draft.write((key, "inner"), f"[{key}{blank}.{blank}'inner']\n")
            pairs((key, "inner"))
            continue
        for element in range(draw(st.integers(1, 3))):
            draft.text += draw(GAPS)
            if element == 0:
                draft.lines[key,] = draft.line
            draft.write((key, element), f"[[{blank}{key}{blank}]]{draw(TAILS)}\n")
            pairs((key, element))
            if draw(st.booleans()):
                draft.write((key, element, "sub"), f"[{key}.sub]\n")
                pairs((key, element, "sub"))
            for inner in range(draw(st.integers(0, 2))):
                if inner == 0:
                    draft.lines[key, element, "many"] = draft.line
                draft.write((key, element, "many", inner), f"[[{key}.many]]\n")
                pairs((key, element, "many", inner))
    return draft


def paths_of(value: object, path: Path = ()) -> set[Path]:
    """Return all paths of what tomllib read: an account that owes nothing to the scanner."""
    result = {path}
    if isinstance(value, dict):
        for key, item in value.items():
            result |= paths_of(item, (*path, key))
    if isinstance(value, list):
        for index, item in enumerate(value):
            result |= paths_of(item, (*path, index))
    return result


@settings(max_examples=300, deadline=None)
@given(draft=documents())
def test_every_key_has_the_line_on_which_it_was_written(draft: Draft) -> None:
    lines = key_lines(draft.text)
    assert {path: lines[path] for path in draft.lines} == draft.lines


@settings(max_examples=300, deadline=None)
@given(draft=documents(), is_windows=st.booleans())
def test_exactly_the_keys_that_tomllib_reads_are_found(draft: Draft, is_windows: bool) -> None:
    text = draft.text.replace("\n", "\r\n") if is_windows else draft.text
    assert set(key_lines(text)) == paths_of(tomllib.loads(text))


@pytest.mark.parametrize(
    ("text", "path", "line"),
    [
        ("a.b = 1\n[a.c]\nx = 2", ("a", "c", "x"), 3),
        ("[a.b]\nx = 1\n[a]\ny = 2", ("a",), 3),
        ("[a.b]\nx = 1", ("a",), 1),
        ("p = { x = 1, y = { z = 2 } }", ("p", "y", "z"), 1),
        ("[[a]]\n[[a]]\n[a.b]\nx = 1", ("a", 1, "b", "x"), 4),
        ("[[a]]\n[[a.b]]\nx = 1\n[[a.b]]\nx = 2\n[[a]]\n[[a.b]]\nx = 3", ("a", 1, "b", 0, "x"), 8),
        ("v = [\n 1,\n [\n  2,\n 3]]", ("v", 1, 1), 5),
        ("v = [ {a = 1},\n {a = 2} ]", ("v", 1, "a"), 2),
        ("\n\n# only a comment", (), 1),
        ('x = """\n\n"""\ny = 1', ("y",), 4),
    ],
)
def test_documents_that_once_were_traps(text: str, path: Path, line: int) -> None:
    assert key_lines(text)[path] == line
