"""A deformed body drawn without a screen: curved skin in colour, discreet element edges, the body at rest in grey."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.mesh import Mesh
from figure.scene.caption import Colouring
from figure.scene.film import Image
from figure.scene.off_screen import load_pyvista_off_screen
from figure.scene.skin import Skin, make_skin
from geometry.errors import InputError

Vectors = Float[NDArray[np.float64], "node 3"]
Motion = Float[NDArray[np.float64], "*frame node 3"]

#: From the body towards the eye. Mostly along the chord (x), so that bending along y is seen from the side; the rest
#: from the front and from above, so that the body looks solid.
TOWARDS_EYE = np.array([0.80, -0.62, 0.36])
#: Part of the picture that the body leaves free at each side.
MARGIN = 0.03
#: Drawn this much larger and then reduced: smoother than the anti-aliasing of a software renderer.
OVERSAMPLING = 2
#: Part of the colour that needs no light: shadows must not be read as values.
AMBIENT = 0.65
EDGE_COLOUR, OUTLINE_COLOUR = "#101820", "#8a9299"
#: Largest deflection drawn, as a part of the largest dimension of the bodies.
DEFLECTION = 0.10


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """A parallel projection that shows all given points.

    Parameters
    ----------
    centre
        Point in the middle of the picture, shape (3,) [m].
    towards_eye, up
        Unit vectors, shape (3,) [-].
    half_width, half_height
        Half sizes of the smallest rectangle around the points [m].
    depth
        Radius around the centre that holds all points [m].
    """

    centre: Float[NDArray[np.float64], "3"]
    towards_eye: Float[NDArray[np.float64], "3"]
    up: Float[NDArray[np.float64], "3"]
    half_width: float
    half_height: float
    depth: float


def choose_view(points: Vectors, towards_eye: Float[NDArray[np.float64], "3"] = TOWARDS_EYE) -> View:
    """Look at points from a direction, with z upwards."""
    eye = towards_eye / np.linalg.norm(towards_eye)
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    up = np.cross(eye, right)
    across, upwards = points @ right, points @ up
    along = points @ eye
    middle = [(values.max() + values.min()) / 2 for values in (across, upwards, along)]
    centre = middle[0] * right + middle[1] * up + middle[2] * eye
    return View(
        centre=centre,
        towards_eye=eye,
        up=up,
        half_width=float(np.ptp(across)) / 2,
        half_height=float(np.ptp(upwards)) / 2,
        depth=float(np.linalg.norm(points - centre, axis=1).max()),
    )


def behind(mesh: Mesh, x: float) -> Mesh:
    """The cells on the far side of a plane at x [m], perhaps none; all points stay, so that node numbers do."""
    stay = {kind: nodes[mesh.points[nodes, 0].mean(axis=1) < x] for kind, nodes in mesh.cells.items()}
    return Mesh(points=mesh.points, cells=stay)


@dataclass(kw_only=True, eq=False)
class Scene:
    """An open window in memory; `image` draws the body with the present positions of its nodes.

    Parameters
    ----------
    plotter, surface, lines
        PyVista's window and the two sets of geometry that move.
    skin
        Skin of the mesh.
    lift
        Shift of the lines towards the eye, which a parallel projection does not show but which keeps them in front,
        shape (3,) [m].
    size
        Width and height of the image [pixels].
    """

    plotter: Any
    surface: Any
    lines: Any
    skin: Skin
    lift: Float[NDArray[np.float64], "3"]
    size: tuple[int, int]

    def image(self, nodes: Vectors) -> Image:
        """Picture of the body with its nodes at the given positions, shape (height, width, 3)."""
        from PIL import Image as Pillow

        points = self.skin.sample @ nodes
        self.surface.points = points
        self.surface.point_data["Normals"] = self.skin.normals(nodes)
        self.lines.points = points + self.lift
        # Without it a screenshot may show the frame before.
        self.plotter.render()
        large = Pillow.fromarray(np.asarray(self.plotter.screenshot(return_img=True)))
        return np.asarray(large.resize(self.size, Pillow.Resampling.LANCZOS))


@contextmanager
def scene(mesh: Mesh, colouring: Colouring, view: View, size: tuple[int, int]) -> Iterator[Scene]:
    """Open a scene, and close its window at the end.

    Parameters
    ----------
    mesh
        The body at rest.
    colouring
        Values, limits and colours of the body.
    view
        Projection of the scene.
    size
        Width and height of the images [pixels].

    Raises
    ------
    MissingSoftware
        No picture can be drawn on this machine.
    """
    pyvista = load_pyvista_off_screen()
    skin = make_skin(mesh)
    rest = skin.sample @ mesh.points
    surface = pyvista.PolyData.from_regular_faces(rest, skin.quads)
    surface.point_data["value"] = skin.sample @ colouring.values
    surface.point_data.active_normals = skin.normals(mesh.points)
    lift = view.towards_eye * (0.002 * view.depth)
    lines = _make_polylines(pyvista, rest + lift, skin.edges)
    # Between surface and lines: where the body is at rest, its outline must not flicker.
    outline = _make_polylines(pyvista, rest + lift / 2, skin.edges[skin.is_feature])
    plotter = pyvista.Plotter(off_screen=True, window_size=[OVERSAMPLING * n for n in size], lighting="none")
    try:
        plotter.set_background("white")
        actor = plotter.add_mesh(
            surface,
            scalars="value",
            cmap=colouring.colour_map,
            clim=colouring.limits,
            interpolate_before_map=True,
            show_scalar_bar=False,
            ambient=AMBIENT,
            diffuse=1.02 - AMBIENT,
            specular=0.0,
        )
        actor.prop.interpolation = "phong"
        plotter.add_mesh(lines, color=EDGE_COLOUR, line_width=0.9 * OVERSAMPLING, opacity=0.28, lighting=False)
        plotter.add_mesh(outline, color=OUTLINE_COLOUR, line_width=1.3 * OVERSAMPLING, lighting=False)
        _aim(plotter.camera, view, size)
        # Over the left shoulder of the eye; with the ambient part, a face turned to it has the colour of the bar.
        right = np.cross(view.up, view.towards_eye)
        lamp = view.towards_eye + 0.45 * view.up - 0.55 * right
        plotter.add_light(pyvista.Light(position=view.centre + lamp, focal_point=view.centre, light_type="scene light"))
        plotter.reset_camera_clipping_range()
        yield Scene(plotter=plotter, surface=surface, lines=lines, skin=skin, lift=lift, size=size)
    finally:
        plotter.close()


def _aim(camera: Any, view: View, size: tuple[int, int]) -> None:
    camera.enable_parallel_projection()
    camera.focal_point = view.centre
    camera.position = view.centre + 4 * view.depth * view.towards_eye
    camera.up = view.up
    # VTK's parallel scale is half the height of the picture in world units.
    camera.parallel_scale = max(view.half_height, view.half_width * size[1] / size[0]) / (1 - 2 * MARGIN)
    camera.clipping_range = (view.depth, 7 * view.depth)


def _make_polylines(pyvista: Any, points: Vectors, edges: NDArray[np.int64]) -> Any:
    lines = np.column_stack([np.full(len(edges), edges.shape[1]), edges])
    return pyvista.PolyData(points.copy(), lines=lines.ravel())


def compute_enlargement(mesh: Mesh, displacement: Motion, amplitude: float | None) -> float:
    """Scale factor of a displacement in a picture [-]; 1 where nothing moves.

    Parameters
    ----------
    mesh
        The bodies at rest.
    displacement
        At the nodes, shape (n_node, 3) or (n_frame, n_node, 3).
    amplitude
        Largest deflection drawn [m]; None for `DEFLECTION` times the largest dimension.

    Raises
    ------
    InputError
        Values that are not finite, or an amplitude that is not positive.
    """
    if (lost := int((~np.isfinite(displacement)).sum())) > 0:
        raise InputError(f"displacement has {lost} values that are not finite: solve again")
    if amplitude is not None and not (np.isfinite(amplitude) and amplitude > 0):
        raise InputError(f"amplitude = {amplitude:g} m must be positive: leave it out for a tenth of the bodies' size")
    largest = float(np.linalg.norm(displacement, axis=-1).max())
    wanted = DEFLECTION * float(np.ptp(mesh.points, axis=0).max()) if amplitude is None else amplitude
    return wanted / largest if largest > 0 else 1.0
