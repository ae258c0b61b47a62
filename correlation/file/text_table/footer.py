"""Footer of a table: a closing text, totals such as "Mean;1.0;2.0", or the header of another table."""

from collections.abc import Iterable, Iterator, Mapping

from correlation.errors import CampaignError
from correlation.file.number import MISSING, is_written_number
from correlation.file.text_table.dialect import Dialect, Line
from correlation.file.text_table.open_text import clean

#: Fact of a file whose footer is not read.
FOOTER = "closing rows"
SHOWN_CHARACTERS = 60
#: First characters of numbers.
BEGINNINGS = frozenset("0123456789+-.")


def skip_footer(file: str, lines: Iterable[Line], dialect: Dialect, facts: dict[str, str]) -> Iterator[Line]:
    """Yield the rows of a table without its footer, which becomes a fact, and without empty rows.

    Parameters
    ----------
    file
        Name of the file, for messages.
    lines
        Lines below the header with their numbers.
    dialect
        Dialect of the table.
    facts
        Facts of the file; the footer is added.

    Raises
    ------
    CampaignError
        Rows of numbers follow a row that begins with a word: another table in the same file.
    """
    has_rows, below = False, list[Line]()
    for line in lines:
        number, text = line
        if not below and text[0] in BEGINNINGS:  # nearly all rows
            has_rows = True
            yield line
            continue
        if text[0] == dialect.separator and not text.strip(f"{dialect.separator} "):
            continue
        if not below and not (has_rows and dialect.numeric[0] and _begins_with_word(text, dialect)):
            has_rows = True
            yield line
        elif not below or not _is_row(text, dialect):
            below.append(line)
        elif len(below) == 1 and len(dialect.fields(below[0][1])) == len(dialect.numeric):
            yield from (*below, line)  # one damaged row, which the reader refuses
            below.clear()
        else:
            raise CampaignError(
                f'{file}, line {below[0][0]}: "{_quote(below[0])}" ends a table, and line {number} is a row of numbers '
                "again: write each table, level or repeat into its own file, or remove what is between them"
            )
    if below:
        line_below = f'line {below[0][0]}: "{_quote(below[0])}"'
        facts[FOOTER] = f"{line_below} and what is below it are not part of the table, and not read"


def describe_footer(facts: Mapping[str, str]) -> str:
    """Sentence on the footer of a file, which is not read; empty without a footer."""
    return facts.get(FOOTER, "")


def _begins_with_word(text: str, dialect: Dialect) -> bool:
    """Whether the first field of a line is a word, not a number or the mark of a missing value."""
    beginning = text.lstrip()[:1]
    if not (beginning.isalpha() or beginning in '"*=<~'):
        return False
    try:
        field = dialect.fields(text)[0].strip()
    except ValueError:  # a quotation mark is not closed, which the reader refuses
        return False
    return field.lower() not in MISSING and not is_written_number(field)


def _is_row(text: str, dialect: Dialect) -> bool:
    try:
        fields = dialect.fields(text)
    except ValueError:
        return False
    return len(fields) == len(dialect.numeric) and is_written_number(fields[0])


def _quote(line: Line) -> str:
    return clean(line[1].strip())[:SHOWN_CHARACTERS]
