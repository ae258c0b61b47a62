"""Similar sentences merged into one: a mistake that occurs in many files is printed once."""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from geometry.name_list import MAX_NAMES, join_first_names

if TYPE_CHECKING:
    from correlation.campaign.measurement import Suspicion

#: Names of files, but not keys of a manifest such as run[2].columns.x0.
FILE = re.compile(r"(?<![\w\].])\w[\w.+-]*\.[A-Za-z]\w{1,4}\b")
#: Separate numbers, but not those in names such as x2, which distinguish sensors.
NUMBER = re.compile(r"(?<![\w\".])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w\"])")
ENTRY = re.compile(r"\[\d+\]")
QUOTED = re.compile(r'"[^"]+"')
MANIFEST = "campaign.toml"


def merge_similar(sentences: Sequence[str], *, naming_all: bool = False) -> list[str]:
    """Merge sentences that differ only by the file, by numbers or by their subject.

    More than `MAX_NAMES` groups that differ only by quoted names, such as those of columns, are merged as well.

    Parameters
    ----------
    sentences
        Sentences in order, such as ``where: what``.
    naming_all
        Whether all places are named, not only the first ones.
    """
    groups: dict[str, list[str]] = {}
    for sentence in sentences:
        groups.setdefault(_strip_differences(sentence), []).append(sentence)
    by_names: dict[str, list[list[str]]] = {}
    for kind, members in groups.items():
        by_names.setdefault(QUOTED.sub('""', kind), []).append(members)
    merged = []
    for parts in by_names.values():
        whole = [sentence for members in parts for sentence in members]
        names = list(dict.fromkeys(_find_differing_names(whole)))
        if len(parts) > MAX_NAMES and len(names) > MAX_NAMES:
            merged.append(f"{whole[0]} (also {_name(names[1:], naming_all)})")
        else:
            merged += [_with_count(members, naming_all=naming_all) for members in parts]
    return merged


def _name(names: Sequence[str], naming_all: bool) -> str:
    return ", ".join(names) if naming_all else join_first_names(names)


def _find_differing_names(sentences: Sequence[str]) -> list[str]:
    """Return the first names in quotes that differ between sentences."""
    columns = zip(*(QUOTED.findall(sentence) for sentence in sentences), strict=False)
    return next((list(names) for names in columns if len(set(names)) > 1), [])


def merge_suspicions(suspicions: Sequence["Suspicion"]) -> "tuple[Suspicion, ...]":
    """Merge similar suspicions into one each."""
    groups: dict[str, list[Suspicion]] = {}
    for suspicion in suspicions:
        # A suspicion that is no remark and names no file is compared together with its place.
        text = str(suspicion)
        groups.setdefault(_strip_differences(text) if suspicion.remark or FILE.search(text) else text, []).append(
            suspicion
        )
    merged = []
    for first, *others in groups.values():
        whole = _with_count([str(first), *map(str, others)])
        sentence = f"{first.sentence}{whole.removeprefix(str(first))}"
        merged.append(replace(first, sentence=sentence, alike=tuple(other.where for other in others)))
    return tuple(merged)


def _strip_differences(sentence: str) -> str:
    """Return the sentence without file names and numbers; if it names no file, without its subject."""
    files = [name for name in FILE.findall(sentence) if name != MANIFEST]
    if not files:
        return sentence.partition(": ")[2] or sentence
    return NUMBER.sub("#", ENTRY.sub("[]", FILE.sub("FILE", sentence)))


def _with_count(members: Sequence[str], *, naming_all: bool = False) -> str:
    first = members[0]
    if len(members) == 1:
        return first
    named = [next((name for name in FILE.findall(one) if name != MANIFEST), "") for one in members]
    if not named[0]:
        places = list(dict.fromkeys(one.partition(": ")[0] for one in members))[1:]
        return f"{first} (also {_name(places, naming_all)})" if places else first
    others = len(set(named) - {named[0]})
    if not others:
        return first if len(set(members)) == 1 else f"{first} (so {len(members)} times)"
    if others <= MAX_NAMES or naming_all:
        return f"{first} (also in {', '.join(list(dict.fromkeys(named))[1:])})"
    return f"{first} (also in {others} more files, the last {named[-1]})"


def name_wrong_places(suspicions: "Sequence[Suspicion]") -> str:
    """Name the first places with suspected mistakes in measurements, and how many more there are; empty if none.

    Remarks and suspicions with their own headline are left out.
    """
    wrong = [item for item in suspicions if not item.remark and not item.headline]
    return join_first_names(list(dict.fromkeys(place for item in wrong for place in (item.where, *item.alike))), "; ")
