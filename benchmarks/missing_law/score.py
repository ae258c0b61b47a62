"""Score of one recovered law, and the table of all, with these rules.

place       the true place is in the set of 95 %
error       largest difference between the forces without their means, relative to the largest true force, along the
            true motion at the frequency of largest motion of each level; only of the odd part if no even harmonic was
            measured
covered     fraction of samples with the true force within the band of 95 %, the unseen part included
words       the description has one of the words required for the hidden law (`ASKED`) and none that contradicts it
            (`CONTRARY`); a word that the data cannot determine, such as an asymmetry without even harmonics, is not
            required
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.missing_law.campaign import Trial
from diagnosis.missing_law.basis import EVEN, follow
from diagnosis.missing_law.curves import BAND, draw_coefficients
from diagnosis.missing_law.place_law import PlaceLaw

Record = Mapping[str, Any]
#: Words that the description of a kind must not have.
CONTRARY = {
    "stop": ("softening", "memory"), "play": ("softening", "memory"), "cubic": ("softening", "memory", "gap"),
    "softening": ("hardening", "memory"), "quadratic": ("memory",), "power": ("softening", "memory"),
    "drag": ("memory", "viscous", "Coulomb"), "iwan": ("drag", "viscous"),
}  # fmt: skip
#: Words of which the description of a kind needs one; `are_words_right` also requires a word for a seen even part.
ASKED = {
    "stop": ("hardening", "gap", "stop"), "play": ("hardening", "gap"), "cubic": ("hardening",),
    "softening": ("softening",), "quadratic": (), "power": ("hardening",), "drag": ("drag", "dissipative"),
    "iwan": ("memory", "micro-slip", "Coulomb"),
}  # fmt: skip


def score_law(law: PlaceLaw, trial: Trial) -> tuple[float, float]:
    """Error of a law, and fraction of the samples whose true force is within the band [-]."""
    u, v = follow(trial.coefficients, trial.angular_frequency)
    functions, true = law.basis.forces(u, v), trial.hidden.force(u, v)
    functions = functions - functions.mean(axis=1, keepdims=True)
    true = true - true.mean(axis=1, keepdims=True)
    low, high = np.quantile(np.einsum("snb,db->dsn", functions, draw_coefficients(law)), BAND, axis=0)
    result = functions @ law.posterior.mean
    covered = float(np.mean((true >= low) & (true <= high)))
    difference, half = result - true, true.shape[1] // 2
    if not law.posterior.is_seen[EVEN]:
        difference = (difference - np.roll(difference, half, axis=1)) / 2
    return float(np.abs(difference).max() / np.abs(true).max()), covered


def are_words_right(words: Sequence[str], kind: str, *, sees_even: bool) -> bool:
    """Whether the words of a description are correct; see `words` in the module docstring."""
    asked = ASKED[kind]
    if sees_even and kind in ("stop", "quadratic") and not {"asymmetric", "stop"} & set(words):
        return False
    return (not asked or any(word in words for word in asked)) and not set(CONTRARY[kind]) & set(words)


def make_table(records: Sequence[Record]) -> str:
    """Score as text."""
    made = [record for record in records if record["law"]]
    lines = [f"{len(records)} campaigns, {len(made)} with a law"]
    lines.append(_share("place in the set of 95 %", [record.get("placed", False) for record in records]))
    lines.append(_share("error of the law at most 10 %", [record.get("error", 9.0) <= 0.1 for record in records]))
    lines.append(_share("error of the law at most 20 %", [record.get("error", 9.0) <= 0.2 for record in records]))
    lines.append(f"{'points within the bands of 95 %':<34} {np.mean([record['covered'] for record in made]):.0%}")
    lines.append(_share("words right", [record.get("right", False) for record in records]))
    seconds = [record["seconds"] for record in records]
    lines.append(
        f"{'processor time of a recovery':<34} median {np.median(seconds):.0f} s, most {np.max(seconds):.0f} s"
    )
    for kind in sorted({record["kind"] for record in records}):
        of = [record for record in records if record["kind"] == kind]
        errors = ", ".join(f"{record.get('error', np.nan):.2f}" for record in of)
        lines.append(f"  {kind:<10} {len(of)}: errors {errors}")
    return "\n".join(lines)


def _share(what: str, holds: Sequence[bool]) -> str:
    return f"{what:<34} {sum(holds)} of {len(holds)} ({np.mean(holds):.0%})"
