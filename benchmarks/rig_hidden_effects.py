"""Diagnosis of the rig with a hidden mass, change of a dead weight, cubic spring, or without a hidden effect.

    OMP_NUM_THREADS=1 python -m benchmarks.rig_hidden_effects [--folder FOLDER] [--seeds 3] [--first 1] [--only mass]

The model is the rig of the shipped case with elements of `MODEL_SIZE`; its numerical error follows from elements of
`FINER_SIZE`. Measurements are simulated in time with a reduced model with elements of `SPECIMEN_SIZE`, whose parameters
deviate from the drawing. Existing campaigns and diagnoses in the folder are reused.
"""

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.rig_campaign import HiddenEffect, make_rig_campaign, meshed
from benchmarks.rig_case import stored_run
from correlation.campaign.read_campaign import read_campaign
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.diagnose import diagnose
from study.case.setup import read_case
from study.kind.registry import open_case
from study.shipped_cases import RIG

#: Sizes of elements [m]: no mesh is a refinement of another.
MODEL_SIZE, FINER_SIZE, SPECIMEN_SIZE = 0.003, 0.002, 0.0025
#: Number of modes: up to three times the highest harmonic of the model.
N_MODE = 60
#: Names of the case files.
MODEL, FINER = "rig", "rig_finer"


@dataclass(frozen=True, kw_only=True)
class Planted:
    """Hidden effect with its name and true value in the diagnosis."""

    effect: HiddenEffect
    name: str
    value: float


def planted(force: float) -> list[Planted]:
    """List the three effects and "nothing"; `force` is the dead weight of the drawing [N]."""
    return [
        Planted(effect=HiddenEffect(kind="mass", strength=4e-3), name="mass at tip", value=4e-3),
        Planted(
            effect=HiddenEffect(kind="preload", strength=-7.0),
            name="preload by left dead weight",
            value=1 - 7.0 / force,
        ),
        Planted(effect=HiddenEffect(kind="cubic", strength=4e12), name="cubic at tip", value=4e12),
        Planted(effect=HiddenEffect(kind="nothing"), name="nothing", value=0.0),
    ]


def write_model(folder: Path) -> Path:
    """Write the case of the shipped rig on another mesh, and the finer case for its numerical error."""
    folder.mkdir(parents=True, exist_ok=True)
    shipped, texts = RIG.read_text(encoding="utf-8"), {}
    for stem, size in ((FINER, FINER_SIZE), (MODEL, MODEL_SIZE)):
        texts[stem] = shipped
        for old, new in (('"2.5 mm"\n', f'"{1e3 * size:g} mm"\n'), ("modes = 150", f"modes = {N_MODE}")):
            assert texts[stem].count(old) == 1
            texts[stem] = texts[stem].replace(old, new)
    texts[MODEL] += f'\n[numerical_error]\nmodel = "0 %"\nrefined = ["{FINER}.toml"]\n'
    for stem, text in texts.items():
        (folder / f"{stem}.toml").write_text(text, encoding="utf-8")
    return folder / f"{MODEL}.toml"


def examine(case: Path, folder: Path, hidden: Planted, seed: int) -> dict[str, object]:
    """Make a campaign, diagnose it and store the result."""
    record = folder / f"{hidden.effect.kind}_{seed}.json"
    if record.is_file():
        return dict(json.loads(record.read_text(encoding="utf-8")))
    where, started = folder / f"{hidden.effect.kind}_{seed}", time.process_time()
    if not (where / "campaign.toml").is_file():
        make_rig_campaign(where, meshed(RIG, SPECIMEN_SIZE, N_MODE), seed=seed, effect=hidden.effect)
    made = time.process_time()
    campaign = read_campaign(where)
    setup = read_case(case, campaign, stored_run()).setup
    result = diagnose(campaign, setup.model, setup.calibration_parameters, setup.budget)
    best = next((item for item in result.verdict.effects if item.effect is not None), None)
    row = {
        "planted": hidden.name,
        "seed": seed,
        "finding": result.verdict.finding.value,
        "named": [item.effect.name for item in result.verdict.effects if item.effect is not None],
        "ranking": [item.effect.name for item in result.refits if item.effect is not None],
        "true": hidden.value,
        "found": None if best is None else best.strength,
        "deviation": None if best is None else best.deviation,
        "held_error": [result.baseline.held_out_error, None if best is None else best.held_out_error],
        "sentence": result.verdict.sentence,
        "seconds": [made - started, time.process_time() - made],
    }
    record.write_text(json.dumps(row, indent=1) + "\n", encoding="utf-8")
    return row


def main(words: Sequence[str] | None = None) -> None:
    """Print one line for each effect and seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path("rig_hidden_effects"))
    parser.add_argument("--seeds", type=int, default=3, help="how many")
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--only", choices=["mass", "preload", "cubic", "nothing"], help="one kind of effect")
    given = parser.parse_args(words)
    case = write_model(given.folder / "model")
    print("| planted | seed | named | true | found | held-out error | made, diagnosed [CPU s] |")
    print("|---|---|---|---|---|---|---|")
    for seed in range(given.first, given.first + given.seeds):
        for hidden in planted(open_case(RIG).case.structure.dead_weight.force):
            if given.only not in {None, hidden.effect.kind}:
                continue
            row = examine(case, given.folder, hidden, seed)
            named = " or ".join(row["named"]) or row["finding"]
            result = "-" if row["found"] is None else f"{row['found']:.4g} +- {TWO_SIDED_95 * row['deviation']:.2g}"
            before, after = row["held_error"]
            fell = f"{100 * before:.1f} %" + ("" if after is None else f" to {100 * after:.1f} %")
            made, diagnosed = row["seconds"]
            print(
                f"| {hidden.name} | {seed} | {named} | {row['true']:.4g} | {result} | {fell} "
                f"| {made:.0f}, {diagnosed:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
