r"""Write and read structures with joints for NLvib (MATLAB, Krack and Gross) as ``.mat`` files.

The file contains one struct ``system``:

======================  ==========================================================================================
``M, D, K``             (n, n), full
``Fex1``                (n, 1) complex, f(t) = Re(Fex1 e^{i Omega t}), which is fc - i fs
``nonlinear_elements``  (1, N) cell of structs: ``type``, ``force_direction`` (n, 1), ``islocal`` = 1, ``ishysteretic``
                        (1 for laws with state), ``name``, and the numbers that the law lists in `nlvib`
======================  ==========================================================================================

In MATLAB or Octave, with NLvib on the path::

    load('structure.mat')
    oscillator = MechanicalSystem(system.M, system.D, system.K, system.nonlinear_elements, system.Fex1);

NLvib has no static load, no force above the first harmonic and no varying normal force; its ``quadraticDamper`` is
d q^2 v instead of d abs(v) v. A structure with one of these is refused.

References
----------
Krack and Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer (2019), appendix C.
"""

from pathlib import Path
from typing import Any

import numpy as np

from reduction.errors import ExchangeError
from reduction.file.atomic_file import write_atomically
from reduction.file.matlab_elements import MatlabFileError, read_variables
from reduction.joint_law.registry import LAWS, Joint
from reduction.jointed_system import JointedSystem


def save_nlvib(system: JointedSystem, path: Path | str) -> None:
    """Write a structure with joints for NLvib.

    Parameters
    ----------
    system
        Structure, joints and the load of harmonic 1.
    path
        ``.mat`` file to write; an existing file is replaced in one step.

    Raises
    ------
    ExchangeError
        A joint or load that NLvib does not have, or a file that cannot be written.
    """
    from scipy.io import savemat

    _check_loads(system)
    refuse_structural_damping(system, "NLvib")
    elements = np.empty((1, len(system.joints)), dtype=object)
    for number, joint in enumerate(system.joints):
        elements[0, number] = _make_element(joint)
    force = system.dynamic[1] if len(system.dynamic) > 1 else np.zeros(system.n_dof, dtype=np.complex128)
    content = {
        "M": system.mass,
        "D": system.damping,
        "K": system.stiffness,
        "Fex1": force[:, None],
        "nonlinear_elements": elements,
    }
    write_atomically(path, lambda file: savemat(file, {"system": content}, appendmat=False, long_field_names=True))


def refuse_structural_damping(system: JointedSystem, program: str) -> None:
    """Refuse to export structural damping to a program that does not have it (`ExchangeError`)."""
    if system.structural_damping is not None:
        raise ExchangeError(
            f"the system has structural damping (a complex stiffness), which {program} does not have: give it as "
            "viscous damping, structural_damping / omega at the frequency of interest"
        )


def load_nlvib(path: Path | str) -> JointedSystem:
    """Read a file that `save_nlvib` wrote, or a struct with the same fields from MATLAB or Octave.

    Joints without a field ``name`` are called ``TYPE NUMBER``, counted from 1.

    Raises
    ------
    ExchangeError
        A missing or damaged file, missing fields, or an element without a corresponding joint.
    JointError
        Numbers that are not valid for a structure.
    """
    path = Path(path)
    if not path.is_file():
        raise ExchangeError(f'there is no file "{path}": check its name and folder')
    try:
        data = path.read_bytes()
        if data.startswith(b"MATLAB 7.3"):
            raise ExchangeError(f'"{path}" is a MATLAB file of version 7.3: save it with save(file, "system", "-v7")')
        read = {value.name: value.simplified for value in read_variables(data)}
    except (OSError, MatlabFileError) as error:
        raise ExchangeError(
            f'"{path}" is not a MATLAB file, or damaged ({error}): save it with save(file, "system", "-v7")'
        ) from None
    content = read.get("system")
    if not isinstance(content, dict):
        raise ExchangeError(
            f'"{path}" contains no struct "system": write system = struct("M", M, ...) with plain fields, not objects '
            "of classes"
        )
    matrices = {}
    for field in ("M", "D", "K"):
        if field not in content:
            raise ExchangeError(f'"{path}": system has no field {field}, it has {", ".join(sorted(content)) or "none"}')
        value = content[field]
        matrices[field] = np.atleast_2d(value.toarray() if hasattr(value, "toarray") else value)
    n = len(matrices["M"])
    force = np.zeros((2, n), dtype=np.complex128)
    if np.size(given := content.get("Fex1", ())):
        if np.size(given) != n:
            raise ExchangeError(f'"{path}": Fex1 has {np.size(given)} entries, the mass {n} rows: give one per row')
        force[1] = np.ravel(given)
    elements = content.get("nonlinear_elements", [])
    listed = [elements] if isinstance(elements, dict) else list(np.ravel(np.asarray(elements, dtype=object)))
    return JointedSystem(
        mass=matrices["M"],
        damping=matrices["D"],
        stiffness=matrices["K"],
        joints=[_read_joint(path, number, item) for number, item in enumerate(listed, start=1)],
        harmonic_force=force,
    )


def _check_loads(system: JointedSystem) -> None:
    if system.static.any():
        dof = int(np.flatnonzero(system.static)[0])
        raise ExchangeError(
            f"the static load has {system.static[dof]:g} N on degree of freedom {dof}, but NLvib has no static load: "
            "remove it, or represent it by a gap"
        )
    beyond = np.argwhere(system.dynamic[2:])
    if len(beyond):
        harmonic, dof = beyond[0] + (2, 0)
        raise ExchangeError(
            f"the harmonic force has {system.dynamic[harmonic, dof]:g} N in harmonic {harmonic} on degree of freedom "
            f"{dof}, but NLvib has only harmonic 1: remove it"
        )


def _make_element(given: Joint) -> dict[str, Any]:
    joint = given.exported("NLvib")
    if joint.nlvib is None:
        raise ExchangeError(f'joint "{given.name}" has no counterpart in NLvib: remove it')
    kind, numbers = joint.nlvib
    return {
        "type": kind,
        "name": joint.name,
        "islocal": 1.0,
        "ishysteretic": float(joint.n_slider > 0),
        "force_direction": joint.directions[0][:, None],
        **{theirs: getattr(joint, ours) for theirs, ours in numbers.items()},
    }


def _read_joint(path: Path, number: int, element: Any) -> Joint:
    label = f'"{path}": nonlinear_elements{{{number}}}'
    if not isinstance(element, dict) or "type" not in element:
        raise ExchangeError(f"{label} is not a struct with a field type: give an element of NLvib")
    # NLvib does not distinguish upper and lower case either.
    known = {law.nlvib[0]: (law, law.nlvib[1]) for law in LAWS if law.nlvib is not None}
    kind = next((kind for kind in known if kind.lower() == str(element["type"]).lower()), "")
    if not kind:
        raise ExchangeError(
            f'{label} is of type "{element["type"]}", which has no corresponding joint: give {", ".join(sorted(known))}'
        )
    law, fields = known[kind]
    missing = [field for field in ("force_direction", *fields) if field not in element]
    if missing:
        raise ExchangeError(f"{label}, {kind}, has no field {missing[0]}: give it")
    numbers = {ours: element[theirs] for theirs, ours in fields.items()}
    direction = element["force_direction"]
    direction = direction.toarray() if hasattr(direction, "toarray") else direction
    name = element.get("name", "")
    if np.size(name) and not isinstance(name, str):
        raise ExchangeError(f"{label}: its name is of {type(name).__name__}, not text: give a row of characters")
    name = name if np.size(name) and name else f"{kind} {number}"
    return law.build(name, {"direction": np.ravel(direction)}, numbers)
