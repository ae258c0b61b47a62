"""A first case of sparse matrices of another program."""

from geometry.errors import InputError
from study.new.draft import REDUCTION, CaseDraft, NewCaseRequest, key
from study.run_context import RunContext

UNITS = ("m, kg, s", "mm, tonne, s")


def draft_matrices(request: NewCaseRequest, run: RunContext) -> CaseDraft:
    """Draft a case of mass and stiffness of ANSYS, Nastran, CalculiX or MatrixMarket, with the node of each row."""
    del run
    if len(request.files) not in (2, 3):
        raise InputError("name the files of mass and stiffness, in this order, and the table of nodes if there is one")
    mass, stiffness, *dofs = request.files
    units = request.value("units", "Units of the matrices?", UNITS[0], "a wrong one shifts all frequencies", UNITS)
    fixed = request.fix or tuple(
        str(
            request.value(
                "fix", "Numbers of the fixed nodes, or nothing?", "", "the matrices may already contain the supports"
            ).value
        ).split()
    )
    point = request.value(
        "point",
        "Number of the node at which the structure is driven and measured?",
        "0",
        "its degrees of freedom are retained",
    )
    for node in (*fixed, str(point.value)):
        if not node.isdigit():
            raise InputError(f'"{node}" is not a node number: give numbers such as 12 (--fix, --point)')
    support = f"[[structure.support]]\nnodes = [{', '.join(fixed)}]\n" if fixed else SUPPORT
    return CaseDraft(
        text=f"""\
# docs/matrices.md lists the formats.
[structure]
kind = "matrices"

[structure.files]
mass = {request.relative(mass)}
stiffness = {request.relative(stiffness)}
{"".join(f"dofs = {request.relative(file)}{chr(10)}" for file in dofs)}{key("units", units)}

{support}
# Nodes that stay coordinates: those of joints, loads and sensors.
[[structure.boundary]]
name = "point"
nodes = [{point.value}]{f" # assumed: {point.assumed}" if point.assumed else ""}

{REDUCTION.format(modes=30)}"""
    )


SUPPORT = """\
# Nodes that are fixed, if the matrices do not have their supports already:
# [[structure.support]]
# nodes = [1, 2, 3]
"""
