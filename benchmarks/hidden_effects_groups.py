"""Groups of effects that the layout of tests and sensors cannot separate.

Two effects belong to a group if the cosine between their whitened sensitivities, with the calibration parameters
projected out, is large. Sensitivities are those at the calibrated model of a campaign without any effect. Only the
points and the noise of this campaign matter; its seed is not scored. `python -m benchmarks.hidden_effects --groups`
writes the file.
"""

import tempfile
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from diagnosis.screening import Score

FILE = Path(__file__).with_name("hidden_effects_groups.toml")
#: Smallest |cos| of effects of one group, and of listed pairs.
SAME, LISTED = 0.9, 0.7
#: Seed of the campaign without any effect; it is not scored.
SEED = 4000


@dataclass(frozen=True, kw_only=True)
class Groups:
    """Pairs of effects and their |cos|; pairs with at least `same` belong to one group."""

    same: float
    pairs: dict[frozenset[str], float]
    unseen: tuple[str, ...] = ()

    def of(self, effect: str) -> frozenset[str]:
        """Effects that cannot be separated from an effect, without the effect itself."""
        alike = [pair for pair, cosine in self.pairs.items() if effect in pair and cosine >= self.same]
        return frozenset().union(*alike) - {effect}

    @property
    def toml(self) -> str:
        """Contents of the file."""
        lines = [
            "# Effects that the layout of the benchmark's campaigns cannot tell apart: |cos| of their whitened",
            "# sensitivities, the calibration parameters projected out, is `same` or more. Pairs below are listed for",
            "# what they are. Made before any campaign was scored, by: python -m benchmarks.hidden_effects --groups",
            f"same = {self.same}",
            f"unseen = [{', '.join(_quoted(name) for name in self.unseen)}]",
        ]
        for pair, cosine in sorted(self.pairs.items(), key=lambda item: (-item[1], sorted(item[0]))):
            effects = ", ".join(_quoted(name) for name in sorted(pair))
            lines.append(f"\n[[pair]]\neffects = [{effects}]\ncosine = {cosine:.3f}")
        return "\n".join(lines) + "\n"


def read_groups(file: Path = FILE) -> Groups:
    """Read the groups from the file.

    Raises
    ------
    SystemExit
        The file does not exist.
    """
    if not file.is_file():
        raise SystemExit(f"there is no {file}: make it by python -m benchmarks.hidden_effects --groups")
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    return Groups(
        same=float(table["same"]),
        pairs={frozenset(item["effects"]): float(item["cosine"]) for item in table.get("pair", ())},
        unseen=tuple(table.get("unseen", ())),
    )


def groups_of(scores: "Sequence[Score]", same: float = SAME, listed: float = LISTED) -> Groups:
    """Groups from the directions of all candidates."""
    seen = [score for score in scores if score.direction.any()]
    directions = np.array([score.direction for score in seen])
    cosine = np.abs(directions @ directions.T) if seen else np.zeros((0, 0))
    pairs = {
        frozenset((one.effect.name, other.effect.name)): round(float(cosine[i, j]), 3)
        for i, one in enumerate(seen)
        for j, other in enumerate(seen[:i])
        if cosine[i, j] >= listed
    }
    return Groups(
        same=same, pairs=pairs, unseen=tuple(score.effect.name for score in scores if not score.direction.any())
    )


def make_groups(file: Path = FILE) -> Groups:
    """Screen a campaign without any effect and write the file of groups."""
    from benchmarks.hidden_effects_setup import setup
    from correlation.campaign.read_campaign import read_campaign
    from diagnosis.candidate.catalogue import list_effects
    from diagnosis.fit.arrangement import arrange
    from diagnosis.screening import screen
    from transient.virtual_bench.hidden_effect import make_campaign

    model = setup()
    with tempfile.TemporaryDirectory() as folder:
        make_campaign(folder, seed=SEED, kind="nothing")
        campaign = read_campaign(Path(folder))
        arrangement = arrange(campaign, model.model, model.calibration_parameters, model.budget)
        level = float(campaign.measurement.level.max())
        scores = screen(arrangement, list_effects(model.model, level=level).candidates)
    groups = groups_of(scores)
    file.write_text(groups.toml, encoding="utf-8")
    return groups


def _quoted(name: str) -> str:
    return f'"{name}"'
