"""Arrays laid out as in scenes, their keys there, and their plot."""

import json
import os

import numpy as np

from . import _core
from ._bodies import bare_scene
from ._exports import extends
from ._plain import angles, listed, millimetres, number, own_arguments, place, require


@extends
class Array(_core.Array):
    @classmethod
    def _laid_out(cls, name, layout, at, rotate, directivity, level, source_strength, piston_radius, wave):
        who = f"Array.{name}: "
        keys = {**layout, "at_mm": place(at, who + "at"), "rotate_deg": angles(rotate, who + "rotate"), "directivity": directivity,
                "level": number(level, who + "level"), "source_pa_m": number(source_strength, who + "source_strength"),
                "piston_radius_mm": millimetres(piston_radius, who + "piston_radius")}
        air = {}
        if wave is not None:
            require(wave, _core.Wave, who + "wave")
            air = {"frequency_khz": wave.frequency / 1e3, "medium": {"sound_speed_m_s": wave.sound_speed, "density_kg_m3": wave.density}}
        with own_arguments(f"Array.{name}"):
            array = cls.of_scene((bare_scene(array=keys, **air), ""))
        array._keys = json.dumps(keys)
        return array

    @classmethod
    def grid(cls, nx, ny, pitch=10.16e-3, *, at=(0, 0, 0), rotate=(0, 0, 0), directivity="t4010a1", level=1.0, source_strength=4.386,
             piston_radius=4.5e-3, wave=None):
        """A flat rectangle of transducers that emit along +z, as `array.grid` of a scene.

        Parameters
        ----------
        nx, ny : int
            Number of transducers along x and y.
        pitch : float
            Distance between neighbours [m].
        at : array_like, shape (3,)
            Its centre [m].
        rotate : array_like, shape (3,)
            Angles about the fixed x, then y, then z axis through its centre [deg].
        directivity, level, source_strength, piston_radius, wave
            As of `Array`.

        Examples
        --------
        >>> len(tf.Array.grid(16, 16, 10e-3))
        256
        """
        layout = {"grid": {"count": [nx, ny], "pitch_mm": millimetres(pitch, "Array.grid: pitch")}}
        return cls._laid_out("grid", layout, at, rotate, directivity, level, source_strength, piston_radius, wave)

    @classmethod
    def autd3(cls, nx=3, ny=2, pitch=10.16e-3, *, units=None, at=(0, 0, 0), rotate=(0, 0, 0), directivity="t4010a1", level=1.0,
              source_strength=4.386, piston_radius=4.5e-3, wave=None):
        """AUTD3 units of 249 transducers each.

        Parameters
        ----------
        nx, ny : int
            Number of units along x and y, edge to edge.
        pitch : float
            Distance between neighbours [m]; boards of 2016 to 2019 have 10.18e-3.
        units : list of tuple, optional
            Instead of nx and ny the place of each unit: position of its transducer 0 [m], and angles about it [deg].
        at, rotate, directivity, level, source_strength, piston_radius, wave
            As of `grid`.

        Examples
        --------
        >>> len(tf.Array.autd3(2, 1))
        498
        """
        layout = {"pitch_mm": millimetres(pitch, "Array.autd3: pitch")}
        if units is None:
            layout["layout"] = [nx, ny]
        else:
            units = listed(units, "Array.autd3: units")
            if not all(hasattr(unit, "__len__") and len(unit) == 2 for unit in units):
                raise TypeError("Array.autd3: units must be a list of pairs: a position and three angles")
            layout["units"] = [{"at_mm": place(unit[0], f"Array.autd3: units[{n}][0]"),
                                "rotate_deg": angles(unit[1], f"Array.autd3: units[{n}][1]")} for n, unit in enumerate(units)]
        return cls._laid_out("autd3", {"autd3": layout}, at, rotate, directivity, level, source_strength, piston_radius, wave)

    @classmethod
    def sonicsurface(cls, *, at=(0, 0, 0), rotate=(0, 0, 0), directivity="t4010a1", level=1.0, source_strength=4.386,
                     piston_radius=4.5e-3, wave=None):
        """The open-hardware board SonicSurface: 16 x 16 transducers at 10.5 mm.

        Parameters
        ----------
        at, rotate, directivity, level, source_strength, piston_radius, wave
            As of `grid`.

        Examples
        --------
        >>> len(tf.Array.sonicsurface())
        256
        """
        return cls._laid_out("sonicsurface", {"sonicsurface": {}}, at, rotate, directivity, level, source_strength, piston_radius, wave)

    @classmethod
    def from_file(cls, path, *, at=(0, 0, 0), rotate=(0, 0, 0), directivity="t4010a1", level=1.0, source_strength=4.386,
                  piston_radius=4.5e-3, wave=None):
        """A table of transducers, as `array.positions.file` of a scene.

        Parameters
        ----------
        path : str or os.PathLike
            With a header of x_mm, y_mm and optionally z_mm, nx, ny, nz, alive; lengths in um, mm, cm or m.
        at, rotate, directivity, level, source_strength, piston_radius, wave
            As of `grid`.

        Raises
        ------
        InputError
            That names file, line and rule.

        Examples
        --------
        >>> _ = open("two.csv", "w").write("x_mm,y_mm\\n0,0\\n10,0\\n")
        >>> len(tf.Array.from_file("two.csv"))
        2
        """
        layout = {"positions": {"file": os.path.abspath(os.fspath(path))}}
        return cls._laid_out("from_file", layout, at, rotate, directivity, level, source_strength, piston_radius, wave)

    def _scene_keys(self):
        given = json.loads(self._keys or "{}")
        if "at_mm" in given:
            return given
        plane, positions, axes, strengths, directivity, ka, _, _, gain, phase, _ = self.__getstate__()
        layout = {"positions": {"points_mm": millimetres(positions, "positions"), "axes": axes.tolist()}}
        if given:
            return layout | given
        if plane:
            return {"plane_wave": {"direction": axes[0].tolist(), "amplitude_pa": float(strengths[0])}}
        if np.ptp(strengths) != 0:
            raise _core.InputError("array: its channels have different strengths, which a scene cannot say")
        keys = layout | {"directivity": directivity, "source_pa_m": float(strengths[0])}
        if directivity == "piston":
            keys["piston_radius_mm"] = 1e3 * ka / _core.Wave().k
        if gain.size:
            keys["calibration"] = {"gain": gain.tolist(), "phase_rad": phase.tolist()}
        return keys

    def plot(self, drives=None, ax=None):
        """Draws the transducers from above with matplotlib.

        Parameters
        ----------
        drives : array_like of complex, shape (N,), or Solution, optional
            Their phases are shown by colour.
        ax : matplotlib.axes.Axes, optional
            Default: new ones.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> array = tf.Array.grid(16, 16)
        >>> ax = array.plot(array.focus([0, 0, 0.15]))
        """
        import matplotlib.pyplot as plt

        ax = plt.figure().add_subplot() if ax is None else ax
        colours = {} if drives is None else {"c": np.angle(getattr(drives, "drives", drives)), "cmap": "twilight", "vmin": -np.pi,
                                             "vmax": np.pi}
        ax.scatter(1e3 * self.positions[:, 0], 1e3 * self.positions[:, 1], s=20, **colours)
        ax.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
        return ax
