"""Score of the advice: numbers of decided and of correct verdicts after the advised test and after a random one."""

from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.hidden_effects_score import Share

Record = Mapping[str, Any]


def is_decided(found: Record) -> bool:
    """Whether the verdict names a single effect."""
    return bool(found["finding"] == "missing")


def is_right(found: Record, record: Record) -> bool:
    """Whether the first named effect is a hidden one, or one that the data cannot separate from it."""
    same = {item["name"] for item in record["effects"]}.union(*found.get("alike", {}).values())
    return bool(found.get("named")) and found["named"][0]["name"] in same


def summarise(record: Record) -> str:
    """Summarise a record in one line."""
    names = ", ".join(item["name"] for item in record.get("effects", [])) or "nothing"
    head = f"{record['seed']:6d}  {names}"
    if "advised" not in record:
        return f"{head}: {record.get('failure') or record.get('reason') or record['first']['finding']}"
    parts = []
    for name in ("advised", "random"):
        if name in record:
            result = record[name]
            right = "right" if is_right(result, record) else "wrong"
            parts.append(f"{name} {result['test']} ({result['expected']:.2f}): {result['finding']}, {right}")
    return f"{head}: {'; '.join(parts)}"


def make_table(records: Sequence[Record]) -> str:
    """Score as text."""
    several = [record for record in records if "advised" in record]
    lines = [f"{len(records)} strangers, {len(several)} whose verdict was several and was measured again"]
    for name in ("advised", "random"):
        of = [(record[name], record) for record in several if name in record]
        decided = [(result, record) for result, record in of if is_decided(result)]
        right = sum(is_right(result, record) for result, record in decided)
        lines.append(f"{name:8} decided {_words(len(decided), len(of))}; of these right {_words(right, len(decided))}")
        if of:
            lines.append(f"{'':8} expected {sum(result['expected'] for result, _ in of):.1f} of {len(of)}")
    return "\n".join(lines)


def _words(count: int, of: int) -> str:
    low, high = Share(count, of).interval
    return f"{count} of {of} ({100 * low:.0f} to {100 * high:.0f} %)"
