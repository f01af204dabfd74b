"""What is to be felt: faces of the skin and the pressure wanted there."""

import numpy as np

from . import _core
from ._bodies import Mesh
from ._plain import Part, core, millimetres


class Target(Part):
    """Faces of a mesh and the wanted pressure on each.

    Parameters
    ----------
    mesh : Mesh
        The skin.
    faces : array_like of int, shape (K,)
        Numbers of the faces, ascending.
    amplitudes : array_like, shape (K,), or float
        Wanted pressure amplitudes [Pa].

    Raises
    ------
    InputError
        On a face that is missing or given twice, or if no pressure is wanted.

    Examples
    --------
    >>> ball = tf.sphere(8e-3, 2e-3)
    >>> below = np.flatnonzero(ball.normals[:, 2] < -0.9)
    >>> target = tf.Target(ball, below, 800)
    """

    def __init__(self, mesh, faces, amplitudes):
        if np.ndim(amplitudes) == 0:
            amplitudes = np.full(len(faces), float(amplitudes))
        self._core = _core.Target(core(mesh, Mesh, "mesh"), faces, amplitudes)
        self.mesh = mesh
        self._keys = None

    @classmethod
    def _of(cls, core, mesh, keys=None):
        target = super()._of(core)
        target.mesh = mesh
        target._keys = keys
        return target

    @classmethod
    def box(cls, mesh, at, size, pressure, *, offset=(0, 0, 0), rotate=(0, 0, 0), profile="uniform"):
        """The faces with their centroids in a box, as `target.box` of a scene.

        Parameters
        ----------
        mesh : Mesh
            The skin.
        at : array_like of shape (3,), or str
            Centre of the box [m], or the name of a landmark.
        size : array_like, shape (3,)
            Its side lengths [m]: width, length, depth.
        pressure : float
            The wanted pressure, or the largest one [Pa].
        offset : array_like, shape (3,)
            From `at` to the centre [m].
        rotate : array_like, shape (3,)
            Angles of the box about the fixed x, then y, then z axis [deg].
        profile : {"uniform", "penetration"}
            The same pressure everywhere, or one proportional to the depth in the box.

        Returns
        -------
        Target

        Raises
        ------
        InputError
            If the box holds no face, or every face.

        Examples
        --------
        >>> ball = tf.sphere(8e-3, 2e-3)
        >>> target = tf.Target.box(ball, at=[0, 0, -8e-3], size=[6e-3, 6e-3, 4e-3], pressure=800)
        """
        skin = core(mesh, Mesh, "mesh")
        centre = mesh._point(at) + np.asarray(offset, float)
        box = {"centre_mm": millimetres(centre), "size_mm": millimetres(size), "rotate_deg": [float(angle) for angle in rotate]}
        found = _core.Target.box(skin, centre, size, np.deg2rad(np.asarray(rotate, float)), profile, pressure)
        return cls._of(found, mesh, {"box": box, "profile": profile, "pressure_pa": float(pressure)})

    @classmethod
    def points(cls, mesh, points, diameter, pressure):
        """Round discs on the skin, as `target.points` of a scene.

        Parameters
        ----------
        mesh : Mesh
            The skin.
        points : array_like of shape (N, 3), or sequence of str
            A disc lies about the point of the skin that is nearest to each of these [m]; or names of landmarks.
        diameter : float
            Of the discs [m].
        pressure : float or array_like, shape (N,)
            The wanted pressure, the same on all or one per disc [Pa].

        Returns
        -------
        Target

        Raises
        ------
        InputError
            If a disc holds no face.

        Examples
        --------
        >>> ball = tf.sphere(8e-3, 1e-3)
        >>> target = tf.Target.points(ball, [[0, 0, -8e-3], [8e-3, 0, 0]], diameter=4e-3, pressure=[800, 400])
        """
        skin = core(mesh, Mesh, "mesh")
        centres = [np.asarray(mesh._point(point), float) for point in points]
        pressures = np.full(len(centres), pressure, float) if np.ndim(pressure) == 0 else np.asarray(pressure, float)
        found = _core.Target.discs(skin, np.reshape(centres, (-1, 3)), diameter, pressures)
        largest = float(pressures.max())
        parts = [{"centre_mm": millimetres(centre), "diameter_mm": millimetres(diameter), "level": float(each) / largest}
                 for centre, each in zip(centres, pressures)]
        return cls._of(found, mesh, {"points": parts, "pressure_pa": largest})

    @classmethod
    def line(cls, mesh, points, width, pressure):
        """A line or path on the skin, as `target.lines` of a scene.

        Parameters
        ----------
        mesh : Mesh
            The skin.
        points : array_like of shape (N, 3), or sequence of str
            Two or more points [m], or names of landmarks. The path goes along the skin nearest to the straight lines between
            them. It is closed if the last point is the first.
        width : float
            Of the line [m].
        pressure : float
            The wanted pressure [Pa].

        Returns
        -------
        Target

        Raises
        ------
        InputError
            If the line holds no face, or no skin leads from one point to the next.

        Examples
        --------
        >>> ball = tf.sphere(8e-3, 1e-3)
        >>> target = tf.Target.line(ball, [[-8e-3, 0, 0], [0, 0, -8e-3], [8e-3, 0, 0]], width=3e-3, pressure=800)
        """
        skin = core(mesh, Mesh, "mesh")
        nodes = [np.asarray(mesh._point(point), float) for point in points]
        found = _core.Target.strip(skin, np.reshape(nodes, (-1, 3)), width, pressure)
        part = {"points": [{"centre_mm": millimetres(node)} for node in nodes], "width_mm": millimetres(width)}
        return cls._of(found, mesh, {"lines": [part], "pressure_pa": float(pressure)})

    @classmethod
    def mask(cls, mesh, levels, pressure):
        """Faces marked one by one, as `target.mask_file` of a scene.

        Parameters
        ----------
        mesh : Mesh
            The skin. In a scene, `body` must be the same mesh; edges of another length are allowed.
        levels : array_like, shape (M,)
            The share of the pressure wanted on each face, 0 to 1, or booleans.
        pressure : float
            The wanted pressure where the level is 1 [Pa].

        Returns
        -------
        Target

        Raises
        ------
        InputError
            If no level is above 0, or every one.

        Examples
        --------
        >>> ball = tf.sphere(8e-3, 1e-3)
        >>> target = tf.Target.mask(ball, ball.normals[:, 2] < -0.9, pressure=800)
        """
        levels = np.asarray(levels, float)
        found = _core.Target.mask(core(mesh, Mesh, "mesh"), levels, pressure)
        return cls._of(found, mesh, {"mask_file": levels, "pressure_pa": float(pressure)})

    @property
    def faces(self):
        """Numbers of the faces, shape (K,)."""
        return self._core.faces

    @property
    def amplitudes(self):
        """The wanted pressure amplitude on each [Pa], shape (K,)."""
        return self._core.amplitudes

    @property
    def centre(self):
        """The number of the face nearest to the centre of the target, where `focus` aims."""
        return self._core.central_face(self.mesh._core)

    def _scene_keys(self):
        if self._keys is None:
            raise _core.InputError("target: a scene has no list of faces with pressures; use Target.mask, or H and Problem")
        return self._keys

    def __len__(self):
        return len(self._core)
