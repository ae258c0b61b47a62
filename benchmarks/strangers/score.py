"""Score of diagnoses of strangers, with these rules.

A record is of one class: *nothing* hidden, *one* effect of the catalogue, *two*, or a *stranger* to the catalogue.

same            an effect is *the same* as a hidden one if it is that effect, or if the whitened changes of all readings
                by both are parallel after the calibration parameters are projected out, |cos| > 0.95 at the calibrated
                model (`Score.direction`): no campaign of this layout can separate them. Mass at two near places, or
                preload and friction coefficient under a constant normal load, are therefore one group.
first           one: the first effect that the verdict names (missing or ambiguous) is the same as the hidden one
seen            all hidden effects change the readings by more than ten standard deviations of noise, jitter,
                histories and numerical error, with the calibration parameters projected out, at the calibrated model of
                the diagnosis (of the first round); the z of a plan is the signature at the drawn model (`signature`)
among           one: the verdict names an effect that is the same, at any position
kind            one: the first named effect is of the hidden kind
itself          one: the first named effect is the hidden one, in kind and place
strength        of the records of `itself`: the error of the strength is at most 20 % of the distance of the true
                strength from the vanishing value, or the true strength lies inside the reported interval of 95 %
covered         of the same records: the true strength lies inside the interval
false alarm     nothing: any verdict except "nothing is missing" and "not testable"
wrong           all classes: the verdict is "X is missing", alone or with a further effect, and X or the further effect
                is the same as no hidden effect, or both are the same as one hidden effect
unknown         stranger: the verdict is "none of the known effects"; placed: and at the hidden place
both            two: the first names of the rounds, each added before the next round, and the further effects named with
                them, include both hidden effects or effects that are the same; one of two: include at least one
missed          one, two, stranger: the verdict is that nothing is missing, or that this cannot be tested
failed          a crash, or no verdict within the limit of processor time; it counts against every rule
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import permutations
from typing import Any

import numpy as np

from benchmarks.hidden_effects_score import Share

Record = Mapping[str, Any]
CLEAR, NO_ALARM = ("missing", "ambiguous"), ("nothing", "not testable")
#: Change of the readings above which an effect is seen [standard deviations].
SEEN = 10.0


def class_of(record: Record) -> str:
    """Class of a record by its hidden effects."""
    effects = record["effects"]
    if not effects:
        return "nothing"
    if not effects[0]["known"]:
        return "stranger"
    return "one" if len(effects) == 1 else "two"


def kind_of(name: str) -> str:
    """Kind of an effect: the part of its name before the place."""
    return min((name.partition(f" {word} ")[0] for word in ("at", "of", "between", "by")), key=len)


def named(record: Record, number: int = 0) -> list[Mapping[str, Any]]:
    """Effects that a round names, best first."""
    done = record["rounds"][number]
    return list(done["named"]) if done["finding"] in CLEAR else []


def same(record: Record, number: int = 0) -> set[str]:
    """Hidden effects, and effects that a round could not separate from them."""
    return set().union(*groups(record, number))


def groups(record: Record, number: int = 0) -> list[set[str]]:
    """For each hidden effect, the effect and those that a round could not separate from it."""
    alike = record["rounds"][number].get("alike", {})
    return [{item["name"], *alike.get(item["name"], ())} for item in record["effects"]]


def is_first(record: Record) -> bool:
    """Whether rule `first` holds."""
    return bool(named(record)) and named(record)[0]["name"] in same(record)


def is_seen(record: Record) -> bool:
    """Whether rule `seen` holds."""
    seen = record["rounds"][0].get("seen", {})
    return bool(seen) and all(size > SEEN for size in seen.values())


def is_among(record: Record) -> bool:
    """Whether rule `among` holds."""
    return any(item["name"] in same(record) for item in named(record))


def is_kind(record: Record) -> bool:
    """Whether rule `kind` holds."""
    return bool(named(record)) and kind_of(named(record)[0]["name"]) == kind_of(record["effects"][0]["name"])


def is_itself(record: Record) -> bool:
    """Whether rule `itself` holds."""
    return bool(named(record)) and named(record)[0]["name"] == record["effects"][0]["name"]


def is_covered(record: Record) -> bool:
    """Whether rule `covered` holds."""
    result, true = named(record)[0], record["effects"][0]
    return abs(result["strength"] - true["strength"]) <= result["half"]


def is_strong(record: Record) -> bool:
    """Whether rule `strength` holds."""
    result, true = named(record)[0], record["effects"][0]
    error = abs(result["strength"] - true["strength"]) / abs(true["strength"] - true["vanishes"])
    return error <= 0.2 or is_covered(record)


def is_wrong(record: Record) -> bool:
    """Whether rule `wrong` holds."""
    verdict = record["rounds"][0]
    if verdict["finding"] != "missing":
        return False
    names = [verdict["named"][0]["name"], *([verdict["further"]["name"]] if verdict.get("further") else [])]
    # Each name must belong to a different hidden effect.
    return not any(
        all(name in group for name, group in zip(names, order, strict=True))
        for order in permutations(groups(record), len(names))
    )


def n_found(record: Record) -> int:
    """Number of hidden effects that the rounds name, themselves or by an effect that is the same."""
    result: set[int] = set()
    for number in range(len(record["rounds"])):
        names = {item["name"] for item in named(record, number)[:1]}
        further = record["rounds"][number].get("further")
        names |= {further["name"]} if further and names else set()
        result |= {place for place, group in enumerate(groups(record, number)) if names & group}
    return len(result)


def table(records: Sequence[Record]) -> str:
    """Score as text."""
    made = [record for record in records if record["made"]]
    by = {
        name: [record for record in made if class_of(record) == name] for name in ("nothing", "one", "two", "stranger")
    }
    itself = [record for record in by["one"] if is_itself(record)]
    finding = _has_finding
    lines = [
        f"{len(records)} strangers, {len(records) - len(made)} could not be made; "
        + ", ".join(f"{name} {len(of)}" for name, of in by.items()),
        _line("one: right effect or group first", by["one"], is_first),
        _line(f"the same, seen above {SEEN:.0f}", [item for item in by["one"] if is_seen(item)], is_first),
        _line("one: among those named", by["one"], is_among),
        _line("one: right kind first", by["one"], is_kind),
        _line("one: right kind and place first", by["one"], is_itself),
        _line("strength within 20 % or interval", itself, is_strong),
        _line("95 % interval holds the strength", itself, is_covered),
        _line("nothing: false alarm", by["nothing"], lambda item: not finding(item, *NO_ALARM)),
        _line("confident wrong name, all classes", made, is_wrong),
        _line("stranger: told unknown", by["stranger"], _is_unknown),
        _line(f"the same, seen above {SEEN:.0f}", [item for item in by["stranger"] if is_seen(item)], _is_unknown),
        _line("stranger: told unknown, and its place", by["stranger"], _is_placed),
        _line("two: both found", by["two"], _are_found),
        _line(f"the same, seen above {SEEN:.0f}", [item for item in by["two"] if is_seen(item)], _are_found),
        _line("two: at least one found", by["two"], lambda item: n_found(item) >= 1),
        _line(
            "hidden, but told nothing", by["one"] + by["two"] + by["stranger"], lambda item: finding(item, *NO_ALARM)
        ),
        _line("failed", made, lambda item: finding(item, "failed")),
        _cost("processor time of a diagnosis", [item["rounds"][0]["seconds"] for item in made]),
        _cost("to plan a campaign", [item["plan_seconds"] for item in made]),
        _cost("to measure it", [item["measure_seconds"] for item in made]),
        *_confusion(made),
        *[f"  seed {item['seed']}: {item['failure']}" for item in records if not item["made"]],
        *[f"  seed {item['seed']}: {item['rounds'][0]['failure']}" for item in made if finding(item, "failed")],
    ]
    return "\n".join(lines)


def summary(record: Record) -> str:
    """Summarise a record in one line."""
    if not record["made"]:
        return f"seed {record['seed']}: not made: {record['failure']}"
    hidden = " + ".join(f"{item['name']} (z {item['z']:.0f})" for item in record["effects"]) or "nothing"
    found = "; ".join(
        " or ".join(item["name"] for item in named(record, number)) or done["finding"]
        for number, done in enumerate(record["rounds"])
    )
    structure = record["structure"]
    return (
        f"seed {record['seed']} {structure['kind']} {structure['dofs']}/{structure['contacts']}: {hidden} -> {found} "
        f"({record['measure_seconds']:.0f} + {record['rounds'][0]['seconds']:.0f} s)"
    )


def _has_finding(record: Record, *findings: str) -> bool:
    return record["rounds"][0]["finding"] in findings


def _is_unknown(record: Record) -> bool:
    return _has_finding(record, "unknown")


def _are_found(record: Record) -> bool:
    return n_found(record) == len(record["effects"])


def _is_placed(record: Record) -> bool:
    place = record["rounds"][0].get("place")
    return _has_finding(record, "unknown") and place == record["effects"][0]["name"].partition(" at ")[2]


def _line(words: str, records: Sequence[Record], holds: Callable[[Record], bool]) -> str:
    share = Share(count=sum(map(holds, records)), of=len(records))
    low, high = share.interval
    return f"{words:<38} {share.count:>4} of {share.of:<4} {share.value:7.1%}  ({low:.0%} to {high:.0%})"


def _cost(words: str, values: Iterable[float]) -> str:
    listed = list(values) or [np.nan]
    return f"{words:<38} median {np.median(listed):.1f} s, 95 % {np.quantile(listed, 0.95):.1f} s"


def _confusion(records: Sequence[Record]) -> list[str]:
    """Lines of the confusion matrix: hidden kinds and first named kinds or findings."""
    counts: dict[str, Counter[str]] = {}
    for record in records:
        kinds = " + ".join(sorted(kind_of(item["name"]) for item in record["effects"])) or "nothing"
        first = kind_of(named(record)[0]["name"]) if named(record) else record["rounds"][0]["finding"]
        first += "" if len(named(record)) < 2 else " or another"
        counts.setdefault(kinds, Counter())[first] += 1
    return ["hidden -> told"] + [
        f"  {kinds:<34} {', '.join(f'{first} {count}' for first, count in counts[kinds].most_common())}"
        for kinds in sorted(counts)
    ]
