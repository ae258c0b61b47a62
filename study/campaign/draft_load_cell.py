"""Drafts of load cells: pairs behind a contact line, from which its tangential and normal force follow."""

from collections.abc import Iterator

from correlation.campaign.measurement import CONTACT_FORCE, LOAD_CELL
from study.campaign.draft import ManifestDraft
from study.campaign.question import Marked

LINES = ("left", "right")
ANGLES = {
    "taper": ("8.53 deg", "taper of the contact line", "theta"),
    "arm": ("45 deg", "angle of the arms of the load cells", "alpha"),
}


def draft_load_cells(draft: ManifestDraft) -> None:
    """Pair the load cells of a draft by their numbers; a cell without a partner or a phase is left out.

    Parameters
    ----------
    draft
        Draft with its sensors and runs; ``[[load_cells]]`` and the sensors of contact forces are added.
    """
    cells = {entry["name"]: entry for entry in draft.entries["sensor"] if entry["quantity"] == LOAD_CELL}
    pairs = [pair for pair in _find_pairs([*cells]) if all("phase" not in cells[name] for name in pair)]
    for number, (first, second) in enumerate(pairs):
        default = LINES[number] if number < len(LINES) else f"line {number + 1}"
        line = draft.ask(
            f"Which contact line of the case do {first} and {second} measure?", default, "not stated in the files"
        )
        forces = {"tangential": f"{line.value}_T", "normal": f"{line.value}_N"}
        for component, name in forces.items():
            force = {"name": name, "quantity": CONTACT_FORCE, "line": line, "component": component}
            draft.entries["sensor"].append(force)
        angles = {
            key: draft.ask(
                f"What is the {words} behind {first} and {second}?", value,
                f"{symbol} of docs/data/contact_force.md, not stated in any file: take it from the drawing",
            )
            for key, (value, words, symbol) in ANGLES.items()
        }  # fmt: skip
        side = Marked(value="de-coupler", assumed='for a line on the blade write "blade" and its dead_weight')
        draft.entries["load_cells"].append({"cells": [first, second], **forces, **angles, "side": side})
    alone = cells.keys() - {name for pair in pairs for name in pair}
    for name in sorted(alone):
        draft.left_out.append(
            f'load cell "{name}": contact forces need two load cells of one line, such as R3 and R4, with phases'
        )
        for run in draft.entries["run"]:
            run["columns"].pop(name, None)
    draft.entries["sensor"] = [entry for entry in draft.entries["sensor"] if entry["name"] not in alone]


def _find_pairs(names: list[str]) -> Iterator[tuple[str, str]]:
    """Pairs of cells with the same stem and the numbers 1 and 2, 3 and 4, and so on."""
    for name in sorted(names):
        stem, digit = name[:-1], int(name[-1])
        if digit % 2 and f"{stem}{digit + 1}" in names:
            yield name, f"{stem}{digit + 1}"
