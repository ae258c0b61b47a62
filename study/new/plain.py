"""A first case of plain matrices."""

from geometry.errors import InputError
from study.new.draft import CaseDraft, NewCaseRequest
from study.run_context import RunContext


def draft_plain(request: NewCaseRequest, run: RunContext) -> CaseDraft:
    """Draft a case of a NumPy or MATLAB file with M, K and optionally C, or of a reduced model."""
    from reduction.file.structure_file import load_matrices

    del run
    if len(request.files) != 1:
        raise InputError("name the one file with the matrices (.npz, .mat, or the .h5 of a reduced model)")
    (file,) = request.files
    matrices = load_matrices(file)
    damped = bool(abs(matrices.damping).max() > 0)
    damping = "" if damped else '\n[structure.damping]\nratio = "0.5 %" # of the first mode: the file has no damping\n'
    return CaseDraft(
        text=f"""\
# Matrices M, K and perhaps C, in SI units: of a file of NumPy or MATLAB, or a reduced model that stickslip has written.
[structure]
kind = "plain"
file = {request.relative(file)}
{damping}"""
    )
