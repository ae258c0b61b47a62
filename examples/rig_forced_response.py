"""The rig: static equilibrium under dead weights, stuck modes, and response at 1 and 5 N with two friction histories.

The mesh is coarse; the run takes a minute or two. `study/cases/rig.toml` is the same case with `size = "2.5 mm"`.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from figure.response_curves import DrawnCurve, ResponseCurves, response_curves_figure
from figure.style import png
from pipeline.cache_folder import default_folder
from pipeline.store import Store
from study.case.setup import read_case
from study.kind.registry import open_case
from study.kind.rig.contact import make_line_pairs
from study.kind.rig.reduce import stuck_modes
from study.run_context import silent_run
from study.shipped_cases import RIG
from study.solve.curve import response_curve
from study.solve.model import make_solve_model


def main() -> None:
    text = RIG.read_text(encoding="utf-8")
    for old, new in (("2.5 mm", "8 mm"), ("modes = 150", "modes = 40"), ("[1, 3, 5, 10]", "[1, 5]")):
        text = text.replace(old, new)
    Path("coarse_rig.toml").write_text(text.replace("histories = 3", "histories = 2"), encoding="utf-8")
    opened = open_case("coarse_rig.toml")
    read = read_case(opened, run=replace(silent_run(), store=Store(default_folder())))
    resting, pairs = read.structure.details, make_line_pairs(opened.case, read.structure.details.model.rig)
    reduction, tangents = resting.reduction, opened.case.structure.contact.sliding
    frequency = stuck_modes(reduction.assembly, pairs, tangents)[0]
    print(f"{reduction.n_dof} degrees of freedom reduced to {reduction.assembly.n_dof}")
    print("all contacts stuck:", ", ".join(f"{hertz:.1f}" for hertz in frequency[:4]), "Hz")

    print("normal force of a line at rest:", np.split(resting.static_state.normal, 4)[0].sum().round(2), "N")
    solved = make_solve_model(read)
    tip, drawn, highest = solved.outputs[0].row, [], {}
    for curve in solved.curves:
        branch = response_curve(solved.system, curve, solved.harmonics, solved.n_sample)
        response = 1e6 * branch.coefficients[:, 1] @ tip
        highest[curve.label] = float(np.abs(response).max())
        print(f"{curve.label}: {highest[curve.label]:.2f} um at most")
        drawn.append(DrawnCurve(label=curve.label, parameter=branch.frequency, response=response))
    words = {"parameter_label": "frequency [Hz]", "amplitude_label": "amplitude [µm]"}
    curves = ResponseCurves(curves=drawn, title="Rig: tip", **words)
    Path("rig_response.png").write_bytes(png(response_curves_figure(curves)))
    print("rig_response.png")
    # At 1 N all contacts stick for any history. At 5 N friction lowers the response per force by a third or more, and
    # histories differ.
    assert abs(highest["1 N, history 2"] / highest["1 N, history 1"] - 1) < 0.01
    assert highest["5 N, history 1"] < 5 * highest["1 N, history 1"] / 1.5
    assert abs(highest["5 N, history 2"] / highest["5 N, history 1"] - 1) > 0.02


if __name__ == "__main__":
    main()
