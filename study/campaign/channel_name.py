"""Names of channels that only their file or group names, such as ``acc_tip.wav``: the words that differ there."""

import re
from collections.abc import Sequence
from dataclasses import replace

from correlation.file.quantity import MOTION_WORDS
from study.campaign.column_role import ComplexPart, Role, name_words
from study.campaign.run_name import LEVEL_IN_NAME, OF_A_RUN, PLACE
from study.campaign.table import make_file_stem
from study.campaign.table_kind import OF_FILE, JudgedTable, Kind

#: Name given to a channel without a name.
NUMBERED = re.compile(r"channel \d+")


def name_channels(tables: Sequence[JudgedTable]) -> list[JudgedTable]:
    """Name channels by the words in which the names of their files or groups differ; other tables are unchanged.

    Parameters
    ----------
    tables
        Judged tables of all files.
    """
    words = {
        id(judged): _list_words(judged)
        for judged in tables
        if any(_is_of_file(judged, name) for name in judged.columns)
    }
    if len(words) < 2:
        return list(tables)
    common = set.intersection(*map(set, words.values()))
    return [
        _rename_channels(judged, [word for word in words.get(id(judged), ()) if word not in common])
        for judged in tables
    ]


def _is_of_file(judged: JudgedTable, column: str) -> bool:
    """Whether only the name of the file states the quantity of a channel, or the place of the only channel."""
    guess = judged.columns[column]
    if guess.role is not Role.RESPONSE:
        return False
    main = [one for one in judged.of_role(Role.RESPONSE) if judged.columns[one.name].part is not ComplexPart.IMAGINARY]
    alone = len(main) == 1
    is_decay = judged.kind is Kind.RING_DOWN and NUMBERED.fullmatch(column) is not None
    return guess.evidence.startswith(OF_FILE) or (alone and (is_decay or _names_a_place(judged, column)))


def _names_a_place(judged: JudgedTable, column: str) -> bool:
    """Whether the name of a file states the place of the sensor, "acc_tip_3N.csv", and that of its channel does not."""
    stem = {*judged.columns[column].stem.split()}
    return stem <= set().union(*MOTION_WORDS.values()) and any(PLACE.fullmatch(word) for word in _split_names(judged))


def _list_words(judged: JudgedTable) -> list[str]:
    """Words of the names of a file and a group that may name a sensor: places, or all words for a nameless channel."""
    of_file = any(one.evidence.startswith(OF_FILE) or NUMBERED.fullmatch(name) for name, one in judged.columns.items())
    parts = [part for part in _split_names(judged) if of_file or PLACE.fullmatch(part)]
    return [" ".join(name_words(part)) for part in parts]


def _split_names(judged: JudgedTable) -> list[str]:
    """Words of the names of a file and a group that do not identify a run."""
    whole = LEVEL_IN_NAME.sub("", f"{make_file_stem(judged.table.file.path.name)} {judged.table.path}")
    return [part for part in re.split(r"[\W_]+", whole) if not OF_A_RUN.fullmatch(part)]


def _rename_channels(judged: JudgedTable, words: Sequence[str]) -> JudgedTable:
    """Table whose channels, and their phases, are named by some words."""
    stems = {guess.stem for name, guess in judged.columns.items() if _is_of_file(judged, name)}
    if not words or not stems:
        return judged
    columns = dict(judged.columns)
    for name, guess in judged.columns.items():
        if guess.stem in stems and (_is_of_file(judged, name) or guess.role is Role.PHASE):
            own = [guess.stem] if len(stems) > 1 else []
            columns[name] = replace(guess, stem=" ".join([*words, *own]))
    return replace(judged, columns=columns)
