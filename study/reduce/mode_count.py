"""What is said of a body that keeps fewer fixed-interface modes than a case asks for."""

from collections.abc import Mapping

from reduction.assembly import ReducedAssembly


def fewer_modes(n_mode: int, n_asked: int, of: str = "the interior", key: str = "modes") -> list[str]:
    """One sentence if there are fewer modes than were asked for, none else.

    Parameters
    ----------
    n_mode, n_asked
        Kept, and as the case has it [-].
    of, key
        What has these modes, and what the case calls their number.
    """
    if n_mode >= n_asked:
        return []
    return [f"all {n_mode} fixed-interface modes of {of} are kept: there are no more, though {key} = {n_asked}"]


def fewer_modes_of_rig(assembly: ReducedAssembly, asked: int | Mapping[str, int]) -> list[str]:
    """The same of a rig, whose modes are asked for of all bodies together or of each: a sentence for each number."""
    kept = {body: len(rom.fixed_interface_frequency) for body, rom in assembly.bodies.items()}
    if isinstance(asked, Mapping):
        return [said for body, n in asked.items() for said in fewer_modes(kept[body], n, body, body)]
    return fewer_modes(sum(kept.values()), asked, "the bodies")
