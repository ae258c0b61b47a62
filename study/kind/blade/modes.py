"""Mode shapes of a blade in full, neither reduced nor in contact."""

from fe.modal import modes
from pipeline.store import stage
from study.case.kind import OpenCase
from study.kind.blade.model import BladeModel, clamped, mesh_size
from study.kind.blade.reduce import model_of_case
from study.modes.report import MODE_SECONDS, write_modes
from study.modes.shapes import Shapes, shapes_of
from study.run_context import Answer, RunContext


@stage("mode shapes of a blade")
def blade_shapes(model: BladeModel, n_mode: int) -> Shapes:
    """Compute the lowest modes of a clamped blade."""
    mesh, system, _ = clamped(model)
    return shapes_of(mesh, model.material, system, modes(system, n_mode))


def blade_modes(opened: OpenCase, run: RunContext, n_mode: int, film_of: int | None) -> Answer:
    """Compute and draw the lowest modes of a case."""
    model = model_of_case(opened, run)
    n_dof = run.store.run(mesh_size, model)
    shapes = run.step("modes", expected=MODE_SECONDS * n_dof / 1e4).run(blade_shapes, model, n_mode)
    return write_modes(shapes, opened.path.stem, film_of, run)
