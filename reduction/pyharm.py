"""Export structures with joints to pyHarm (Python, PyPI name pyHarm-os), as input dictionary or JSON file.

JSON has no arrays; with pyHarm installed, the file is run with::

    import json
    import numpy as np
    from pyHarm.Maestro import Maestro

    with open("structure.json") as file:
        data = json.load(file)
    for part in data["substructures"].values():
        part["matrix"] = {name: np.array(rows) for name, rows in part["matrix"].items()}
    study = Maestro(data)
    study.operate()

The structure is one substructure, ``structure``, with one direction; its nodes are the degrees of freedom. A joint of
pyHarm acts on one degree of freedom or between two. Its friction law with a varying normal force differs from
`FrictionContact`: the limit remains mu N0 after lift-off. A structure with a friction contact or a quadratic damper is
therefore refused.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from reduction.errors import ExchangeError
from reduction.file.atomic_file import write_atomically
from reduction.joint_law.registry import Joint
from reduction.jointed_system import JointedSystem
from reduction.nlvib import refuse_structural_damping

PART = "structure"


def make_pyharm_input(
    system: JointedSystem, first: float, last: float, *, n_harmonic: int = 6, n_sample: int = 256
) -> dict[str, Any]:
    """Make the input of pyHarm for a frequency response, of dictionaries, lists and numbers only.

    Parameters
    ----------
    system
        Structure, joints and loads.
    first, last
        Ends of the frequency range [rad/s].
    n_harmonic
        Number of harmonics, 0 to n_harmonic - 1, at least 2 [-].
    n_sample
        Number of samples per period [-].

    Raises
    ------
    ExchangeError
        A joint that pyHarm does not have, a load above the highest harmonic, or an invalid range or number of
        harmonics.
    """
    if not 0 < first < last < np.inf:
        raise ExchangeError(f"the range {first:g} to {last:g} rad/s must be positive and ascend: exchange its ends")
    if n_harmonic < 2:
        raise ExchangeError(f"n_harmonic = {n_harmonic} keeps only the mean: take at least 2, which adds harmonic 1")
    refuse_structural_damping(system, "pyHarm")
    connectors = {joint.name: _make_connector(joint) for joint in system.joints}
    for name, load in _make_loads(system, n_harmonic).items():
        if name in connectors:
            raise ExchangeError(f'joint "{name}" has the name of a load of pyHarm: give the joint another one')
        connectors[name] = load
    matrix = {"M": system.mass.tolist(), "C": system.damping.tolist(), "K": system.stiffness.tolist()}
    return {
        "system": {"type": "Base", "nh": n_harmonic - 1, "nti": n_sample},
        "substructures": {PART: {"matrix": matrix, "ndofs": 1, "nnodes": system.n_dof, "nmodes": 0}},
        "connectors": connectors,
        "analysis": {"frf": {"study": "frf", "puls_inf": float(first), "puls_sup": float(last)}},
    }


def save_pyharm(
    system: JointedSystem, path: Path | str, first: float, last: float, *, n_harmonic: int = 6, n_sample: int = 256
) -> None:
    """Write the result of `make_pyharm_input` as JSON; an existing file is replaced in one step.

    Raises
    ------
    ExchangeError
        As in `make_pyharm_input`, or a file that cannot be written.
    """
    text = json.dumps(make_pyharm_input(system, first, last, n_harmonic=n_harmonic, n_sample=n_sample), allow_nan=False)
    write_atomically(path, lambda file: file.write_text(text, encoding="utf-8"))


def _make_connector(given: Joint) -> dict[str, Any]:
    joint = given.exported("pyHarm")
    dof, other, scale = _find_ends(joint)
    # With u = scale (q_dof - q_other), the force of the joint on each is scale f(u).
    return {**_place(dof, other), **joint.pyharm(scale)}


def _find_ends(joint: Joint) -> tuple[int, int | None, float]:
    """Degree of freedom of a joint, the degree of freedom that it moves against, and a positive scale."""
    row = joint.directions[0]
    dofs = np.flatnonzero(row)
    if len(dofs) == 1:
        dof, weight = int(dofs[0]), float(row[dofs[0]])
        if weight > 0 or not joint.one_sided:
            return dof, None, abs(weight)
        raise ExchangeError(
            f'joint "{joint.name}" stops degree of freedom {dof} in its negative direction, which pyHarm cannot '
            "represent: reverse the sign of this degree of freedom in all matrices"
        )
    if len(dofs) == 2 and row[dofs].sum() == 0:
        low, high = sorted(map(int, dofs), key=lambda dof: row[dof])
        return high, low, float(row[high])
    weights = ", ".join(f"{weight:g}" for weight in row[dofs][:4]) + (", ..." if len(dofs) > 4 else "")
    raise ExchangeError(
        f'joint "{joint.name}" acts on {len(dofs)} degrees of freedom with the weights {weights}, but pyHarm supports '
        "only one degree of freedom, or the difference of two: make the direction a degree of freedom of the reduced "
        "model"
    )


def _place(dof: int, other: int | None = None) -> dict[str, Any]:
    return {"connect": {PART: [dof]} if other is None else {PART: [dof], "INTERNAL": [other]}, "dirs": [0]}


def _make_loads(system: JointedSystem, n_harmonic: int) -> dict[str, dict[str, Any]]:
    """One forcing for each loaded degree of freedom and harmonic."""
    loads = {}
    for harmonic, dof in np.argwhere(np.vstack([system.static, system.dynamic[1:]])):
        if harmonic >= n_harmonic:
            raise ExchangeError(
                f"the harmonic force acts at harmonic {harmonic} on degree of freedom {dof}, but n_harmonic = "
                f"{n_harmonic} keeps 0 to {n_harmonic - 1}: take at least {harmonic + 1}"
            )
        force = complex(system.dynamic[harmonic, dof]) if harmonic else complex(system.static[dof])
        # pyHarm's load is amp cos(k Omega t - phi).
        forcing = {"amp": abs(force), "ho": int(harmonic), "dto": 0, "phi": float(-np.angle(force))}
        if not harmonic:
            forcing |= {"amp": force.real, "phi": 0.0}
        loads[f"load of harmonic {harmonic} on {dof}"] = {"type": "GOForcing", **_place(int(dof)), **forcing}
    return loads
