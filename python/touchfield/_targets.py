"""Targets as scenes have them, and their keys there."""

import json

import numpy as np

from . import _core
from ._bodies import Mesh
from ._exports import extends
from ._plain import angles, listed, millimetres, number, place, require


def _places(mesh, points, argument):
    return [mesh._point(point, f"{argument}[{n}]") for n, point in enumerate(listed(points, argument))]


@extends
class Target(_core.Target):
    def _of_keys(self, **keys):
        self._keys = json.dumps(keys)
        return self

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

        Raises
        ------
        InputError
            If the box holds no face, or every face.

        Examples
        --------
        >>> ball = tf.sphere(8e-3, 2e-3)
        >>> target = tf.Target.box(ball, at=[0, 0, -8e-3], size=[6e-3, 6e-3, 4e-3], pressure=800)
        """
        require(mesh, Mesh, "Target.box: mesh")
        centre = mesh._point(at, "Target.box: at") + _core._three(offset, "Target.box: offset")
        pressure = number(pressure, "Target.box: pressure")
        box = {"centre_mm": place(centre, "at"), "size_mm": place(size, "Target.box: size"),
               "rotate_deg": angles(rotate, "Target.box: rotate")}
        found = cls._box(mesh, centre, size, np.deg2rad(box["rotate_deg"]), profile, pressure)
        return found._of_keys(box=box, profile=profile, pressure_pa=pressure)

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

        Raises
        ------
        InputError
            If a disc holds no face.

        Examples
        --------
        >>> ball = tf.sphere(8e-3, 1e-3)
        >>> target = tf.Target.points(ball, [[0, 0, -8e-3], [8e-3, 0, 0]], diameter=4e-3, pressure=[800, 400])
        """
        require(mesh, Mesh, "Target.points: mesh")
        diameter = number(diameter, "Target.points: diameter")
        centres = _places(mesh, points, "Target.points: points")
        pressures = np.full(len(centres), number(pressure, "Target.points: pressure")) if np.ndim(pressure) == 0 else pressure
        found = cls._points(mesh, np.reshape(centres, (-1, 3)), diameter, pressures)
        largest = float(max(pressures))
        parts = [{"centre_mm": place(centre, "points"), "diameter_mm": millimetres(diameter, "diameter"), "level": float(each) / largest}
                 for centre, each in zip(centres, pressures)]
        return found._of_keys(points=parts, pressure_pa=largest)

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

        Raises
        ------
        InputError
            If the line holds no face, or no skin leads from one point to the next.

        Examples
        --------
        >>> ball = tf.sphere(8e-3, 1e-3)
        >>> target = tf.Target.line(ball, [[-8e-3, 0, 0], [0, 0, -8e-3], [8e-3, 0, 0]], width=3e-3, pressure=800)
        """
        require(mesh, Mesh, "Target.line: mesh")
        width, pressure = number(width, "Target.line: width"), number(pressure, "Target.line: pressure")
        nodes = _places(mesh, points, "Target.line: points")
        found = cls._line(mesh, np.reshape(nodes, (-1, 3)), width, pressure)
        part = {"points": [{"centre_mm": place(node, "points")} for node in nodes], "width_mm": millimetres(width, "width")}
        return found._of_keys(lines=[part], pressure_pa=pressure)

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

        Raises
        ------
        InputError
            If no level is above 0, or every one.

        Examples
        --------
        >>> ball = tf.sphere(8e-3, 1e-3)
        >>> target = tf.Target.mask(ball, ball.normals[:, 2] < -0.9, pressure=800)
        """
        require(mesh, Mesh, "Target.mask: mesh")
        levels, pressure = np.asarray(levels), number(pressure, "Target.mask: pressure")
        levels = levels.astype(float) if levels.dtype == bool else levels
        return cls._mask(mesh, levels, pressure)._of_keys(mask_file=levels.astype(float).tolist(), pressure_pa=pressure)

    def _scene_keys(self):
        if not self._keys:
            raise _core.InputError("target: a scene has no list of faces with pressures; use Target.mask, or H and Problem")
        return json.loads(self._keys)
