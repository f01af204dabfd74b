"""Meshes moved and shown, those of other libraries, and the built-in hand."""

import json

import numpy as np

from . import _core
from ._exports import extends
from ._plain import angles, millimetres, number, own_arguments, plain, place


def _matrix(rotation, argument):
    """Of a matrix, of SciPy's Rotation, or of three angles in degrees about the fixed x, then y, then z axis."""
    if hasattr(rotation, "as_matrix"):
        rotation = rotation.as_matrix()
    matrix = np.asarray(rotation)
    if matrix.ndim < 2:
        matrix = _core._rotation(np.deg2rad(_core._three(rotation, argument)))
    real = matrix.shape == (3, 3) and matrix.dtype.kind in "fiu"
    if not real or not np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6) or np.linalg.det(matrix) < 0:
        raise _core.InputError(f"{argument} must be a rotation matrix (3, 3), three angles in degrees, or an object with as_matrix()")
    return matrix


@extends
class Mesh(_core.Mesh):
    @classmethod
    def from_trimesh(cls, mesh, unit=1.0, landmarks=None):
        """The same surface of a `trimesh.Trimesh`.

        Parameters
        ----------
        mesh : trimesh.Trimesh
        unit : float
            Its unit of length in metres: 1e-3 for mm.
        landmarks : dict of str to array_like, optional
            Named points, in its unit.

        Examples
        --------
        >>> import trimesh  # doctest: +SKIP
        >>> tf.Mesh.from_trimesh(trimesh.load("hand.stl"), unit=1e-3)  # doctest: +SKIP
        """
        return cls(np.asarray(mesh.vertices) * unit, np.asarray(mesh.faces), _scaled(landmarks, unit))

    @classmethod
    def from_pyvista(cls, mesh, unit=1.0, landmarks=None):
        """The same surface of a `pyvista.PolyData`; polygons are cut into triangles.

        Parameters
        ----------
        mesh : pyvista.PolyData
        unit : float
            Its unit of length in metres: 1e-3 for mm.
        landmarks : dict of str to array_like, optional
            Named points, in its unit.

        Examples
        --------
        >>> tf.Mesh.from_pyvista(pyvista.Sphere(5), unit=1e-3)  # doctest: +SKIP
        """
        surface = mesh.triangulate()
        return cls(np.asarray(surface.points, float) * unit, np.asarray(surface.faces).reshape(-1, 4)[:, 1:], _scaled(landmarks, unit))

    def _moved(self, move):
        return Mesh(move(self.vertices), self.triangles, {name: move(point) for name, point in self.landmarks.items()})

    def translate(self, shift):
        """The mesh and its landmarks, moved.

        Parameters
        ----------
        shift : array_like, shape (3,)
            [m]

        Examples
        --------
        >>> round(float(tf.sphere(5e-3, 2e-3).translate([0, 0, 0.2]).centroids[:, 2].mean()), 3)
        0.2
        """
        shift = _core._three(shift, "Mesh.translate: shift")
        return self._moved(lambda points: points + shift)

    def rotate(self, rotation, about=(0, 0, 0)):
        """The mesh and its landmarks, rotated.

        Parameters
        ----------
        rotation : array_like of shape (3, 3) or (3,), or scipy.spatial.transform.Rotation
            A matrix, or angles about the fixed x, then y, then z axis [deg], as `rotate_deg` in a scene.
        about : array_like of shape (3,), or str
            A point [m], or the name of a landmark.

        Examples
        --------
        >>> turned = tf.hand(edge=8e-3).rotate([0, 180, 0], about="palm_centre")
        """
        matrix, centre = _matrix(rotation, "Mesh.rotate: rotation"), self._point(about, "Mesh.rotate: about")
        return self._moved(lambda points: (points - centre) @ matrix.T + centre)

    def scale(self, factor, about=(0, 0, 0)):
        """The mesh and its landmarks, scaled.

        Parameters
        ----------
        factor : float
            Larger than 0.
        about : array_like of shape (3,), or str
            The point that stays [m], or the name of a landmark.

        Examples
        --------
        >>> bool(abs(tf.sphere(5e-3, 2e-3).scale(2).volume / tf.sphere(5e-3, 2e-3).volume - 8) < 1e-9)
        True
        """
        factor, centre = number(factor, "Mesh.scale: factor"), self._point(about, "Mesh.scale: about")
        if not factor > 0:
            raise _core.InputError(f"Mesh.scale: factor = {factor:g} must be > 0")
        return self._moved(lambda points: (points - centre) * factor + centre)

    def place(self, at, landmark="", rotate=(0, 0, 0)):
        """The mesh with one of its points elsewhere, as `body.place` in a scene.

        Parameters
        ----------
        at : array_like, shape (3,)
            Where the point lands [m].
        landmark : str
            The point; "": the origin.
        rotate : array_like
            A rotation about it first, as of `rotate`.

        Examples
        --------
        >>> tf.hand(edge=8e-3).place([0, 0, 0.2], "index_pad").landmarks["index_pad"].tolist()
        [0.0, 0.0, 0.2]
        """
        matrix, goal = _matrix(rotate, "Mesh.place: rotate"), _core._three(at, "Mesh.place: at")
        point = self._point(landmark or (0, 0, 0), "Mesh.place: landmark")
        return self._moved(lambda points: (points - point) @ matrix.T + goal)

    def _point(self, point, argument):
        if not isinstance(point, str):
            return _core._three(point, argument)
        if point not in self.landmarks:
            raise _core.InputError(f"{argument}: landmark '{point}' is missing, the mesh has {', '.join(self.landmarks) or 'none'}")
        return self.landmarks[point]

    def to_trimesh(self):
        """The same surface as a `trimesh.Trimesh` [m].

        Examples
        --------
        >>> tf.sphere(5e-3, 2e-3).to_trimesh()  # doctest: +SKIP
        """
        import trimesh

        return trimesh.Trimesh(self.vertices, self.triangles, process=False)

    def to_pyvista(self, **values):
        """The same surface as a `pyvista.PolyData` [m], which shows itself in 3D.

        Parameters
        ----------
        **values : array_like, shape (M,)
            A number of each face, by name.

        Returns
        -------
        pyvista.PolyData

        Examples
        --------
        >>> tf.hand().to_pyvista(pressure=abs(p)).plot()  # doctest: +SKIP
        """
        import pyvista

        faces = np.hstack([np.full((len(self), 1), 3), self.triangles]).ravel()
        surface = pyvista.PolyData(np.array(self.vertices), faces)
        for name, numbers in values.items():
            surface.cell_data[name] = np.asarray(numbers)
        return surface

    def plot(self, values=None, ax=None, view=(-90, 90), label=""):
        """Draws the mesh in 3D with matplotlib.

        Parameters
        ----------
        values : array_like, shape (M,), optional
            A number of each face, shown by colour with a colour bar.
        ax : matplotlib Axes3D, optional
            Default: new ones.
        view : tuple of float
            Elevation and azimuth of the view [deg]. Default: from an array below the mesh, along z, with y up.
        label : str
            Of the colour bar.

        Returns
        -------
        matplotlib Axes3D

        Examples
        --------
        >>> finger = tf.sphere(5e-3, 2e-3)
        >>> ax = finger.plot(finger.areas, label="area [m2]")
        """
        import matplotlib.pyplot as plt

        ax = plt.figure().add_subplot(projection="3d", proj_type="ortho") if ax is None else ax
        x, y, z = 1e3 * self.vertices.T
        skin = ax.plot_trisurf(x, y, z, triangles=self.triangles, linewidth=0, antialiased=False)
        if values is not None:
            skin.set_array(np.asarray(values, float))
            ax.figure.colorbar(skin, ax=ax, shrink=0.7, label=label)
        sides = np.ptp(self.vertices, axis=0)
        for axis, side in zip("xyz", sides):
            ax.locator_params(axis=axis, nbins=max(1, round(8 * side / sides.max())))
        ax.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]", aspect="equal")
        ax.view_init(*view)
        if abs(view[0]) == 90:  # along z, whose labels are in one place
            ax.set(zticks=[], zlabel="")
        return ax


def _scaled(landmarks, unit):
    return landmarks and {name: np.asarray(point, float) * unit for name, point in landmarks.items()}


def hand(pose="index_up", *, edge=3e-3, breadth=88.3e-3, length=193.3e-3, side="right", forearm=0.25, joints=None, landmark="",
         at=(0, 0, 0), rotate=(0, 0, 0)):
    """The built-in hand, as `body.hand` of a scene.

    Its own frame has the wrist at the origin, y towards the fingertips, and z out of the back of the hand. The thumb of a
    right hand is at negative x.

    Parameters
    ----------
    pose : {"flat", "index_up", "grasp", "point_down", "fist"}
    edge : float or dict
        Wanted edge length [m], 0.3e-3 to 12e-3. Graded: ``{"far": 6e-3, "near": {"index_pad": 1.2e-3}, "within": 15e-3,
        "growth": 0.2}``, with shorter edges within a distance of landmarks.
    breadth, length : float
        Size of the hand [m].
    side : {"right", "left"}
    forearm : float
        Length of forearm beyond the hand's own skin [m]; 0: a hand alone.
    joints : dict, optional
        Angles that differ from the pose [deg]: ``{"index": {"pip_deg": 20}}``.
    landmark : str
        The point that is placed at `at`; "": the hand's own origin.
    at : array_like, shape (3,)
        [m]
    rotate : array_like, shape (3,)
        Angles of a rotation about that point, about the fixed x, then y, then z axis [deg].

    Returns
    -------
    Mesh
        With landmarks: thumb_pad to little_pad, thumb_tip to little_tip, palm_centre, back_centre, wrist.

    Raises
    ------
    InputError
        On an unknown pose or a number out of range.

    Examples
    --------
    >>> skin = tf.hand(edge={"far": 8e-3, "near": {"index_pad": 2e-3}}, landmark="index_pad", at=[0, 0, 0.2])
    """
    if side not in ("right", "left"):
        raise _core.InputError(f"hand: side = '{side}' must be right or left")
    if isinstance(edge, dict):
        edges = {}
        for key, value in edge.items():
            if key == "near" and isinstance(value, dict):
                edges[key] = {name: millimetres(near, f"hand: edge['near']['{name}']") for name, near in value.items()}
            elif key == "growth":
                edges[key] = number(value, "hand: edge['growth']")
            elif key in ("far", "within"):
                edges[{"far": "far", "within": "within_mm"}[key]] = millimetres(number(value, f"hand: edge['{key}']"), key)
            else:
                raise _core.InputError(f"hand: edge['{key}']: must be far, near (a dict), within or growth")
        if not {"far", "near"} <= set(edge):
            raise _core.InputError("hand: edge must have far and near")
    else:
        edges = millimetres(number(edge, "hand: edge"), "edge")
    shape = {"pose": pose, "side": side, "breadth_mm": millimetres(breadth, "hand: breadth"),
             "length_mm": millimetres(length, "hand: length"), "forearm_mm": millimetres(forearm, "hand: forearm")}
    placed = {"landmark": landmark, "at_mm": place(at, "hand: at"), "rotate_deg": angles(rotate, "hand: rotate")}
    body = {"hand": shape | ({"joints": joints} if joints else {}), "edge_mm": edges, "place": placed}
    with own_arguments("hand"):
        return Mesh._of_scene((bare_scene(body=body), ""))


def bare_scene(**parts):
    """A scene of a part alone: what else a scene must have computes nothing."""
    bare = {"name": "part", "array": {"plane_wave": {}}, "body": {"sphere": {"radius_mm": 10}, "edge_mm": 10},
            "solve": {"methods": [{"fixed": {"phases_rad": 0}}]}, "evaluation": "none"}
    return json.dumps(bare | parts, default=plain)
