"""Transducers, and their sound in free air."""

import os

import numpy as np

from . import _core
from ._bodies import bare_scene
from ._plain import Part, core, millimetres


class Wave(Part):
    """Sound of one frequency in air.

    Parameters
    ----------
    frequency : float
        1e3 to 200e3 [Hz].
    temperature : float
        -50 to 60 [degrees C].
    absorption : bool
        Whether the air absorbs sound.

    Raises
    ------
    InputError
        On a value out of range.

    Examples
    --------
    >>> round(1e3 * tf.Wave(40e3).wavelength, 2)
    8.58
    """

    def __init__(self, frequency=40e3, *, temperature=20.0, absorption=False):
        self._core = _core.Wave(frequency, temperature=temperature, absorption=absorption)

    @property
    def frequency(self):
        """[Hz]"""
        return self._core.frequency

    @property
    def wavelength(self):
        """[m]"""
        return self._core.wavelength

    @property
    def k(self):
        """Wavenumber [rad/m]."""
        return self._core.k

    @property
    def sound_speed(self):
        """[m/s]"""
        return self._core.sound_speed

    @property
    def density(self):
        """Of the air [kg/m3]."""
        return self._core.density


def wave_core(wave):
    return Wave()._core if wave is None else core(wave, Wave, "wave")


def drives_of(drives):
    """Complex drives of a solution, or as they are."""
    return getattr(drives, "drives", drives)


class Array(Part):
    """Transducers. An array never changes.

    Parameters
    ----------
    positions : array_like, shape (N, 3)
        [m]
    normals : array_like, shape (N, 3), optional
        Unit vectors along which they emit; default: +z.
    directivity : {"t4010a1", "piston", "omni"}
        Radiation off the axis: that measured for the AUTD3 transducer, that of a piston, or the same in all directions.
    level : float
        Common amplitude of all channels at full drive, 0 < level <= 1.
    source_strength : float
        Pressure at full drive on the axis times the distance [Pa m].
    piston_radius : float
        [m]
    wave : Wave, optional
        Needed for pistons only; default: ``Wave()``.

    Raises
    ------
    InputError
        On normals that are not of unit length, transducers in one place, positions that are not in m.

    Examples
    --------
    >>> len(tf.Array([[0, 0, 0], [0.01, 0, 0]]))
    2
    """

    def __init__(self, positions, normals=None, *, directivity="t4010a1", level=1.0, source_strength=4.386, piston_radius=4.5e-3,
                 wave=None):
        if normals is None:
            normals = np.tile([0.0, 0.0, 1.0], (len(positions), 1))
        self._core = _core.Array(positions, normals, directivity=directivity, level=level, source_strength=source_strength,
                                 piston_radius=piston_radius, wave=wave_core(wave))
        self._keys = None
        self._given = {"directivity": directivity, "level": level, "source_pa_m": source_strength,
                       "piston_radius_mm": millimetres(piston_radius)}

    @classmethod
    def _of(cls, core, keys=None):
        array = super()._of(core)
        array._keys = keys
        array._given = None
        return array

    @classmethod
    def _laid_out(cls, name, layout, at, rotate, directivity, level, source_strength, piston_radius, wave):
        keys = {**layout, "at_mm": millimetres(at), "rotate_deg": [float(angle) for angle in rotate], "directivity": directivity,
                "level": level, "source_pa_m": source_strength, "piston_radius_mm": millimetres(piston_radius)}
        air = {}
        if wave is not None:
            sound = core(wave, Wave, "wave")
            air = {"frequency_khz": sound.frequency / 1e3,
                   "medium": {"sound_speed_m_s": sound.sound_speed, "density_kg_m3": sound.density}}
        return cls._of(_core.Array.of_scene((bare_scene(array=keys, **air), f"Array.{name}")), keys)

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

        Returns
        -------
        Array

        Examples
        --------
        >>> len(tf.Array.grid(16, 16, 10e-3))
        256
        """
        layout = {"grid": {"count": [nx, ny], "pitch_mm": millimetres(pitch)}}
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

        Returns
        -------
        Array

        Examples
        --------
        >>> len(tf.Array.autd3(2, 1))
        498
        """
        layout = {"pitch_mm": millimetres(pitch)}
        if units is None:
            layout["layout"] = [nx, ny]
        else:
            layout["units"] = [{"at_mm": millimetres(place), "rotate_deg": [float(angle) for angle in angles]} for place, angles in units]
        return cls._laid_out("autd3", {"autd3": layout}, at, rotate, directivity, level, source_strength, piston_radius, wave)

    @classmethod
    def sonicsurface(cls, *, at=(0, 0, 0), rotate=(0, 0, 0), directivity="t4010a1", level=1.0, source_strength=4.386,
                     piston_radius=4.5e-3, wave=None):
        """The open-hardware board SonicSurface: 16 x 16 transducers at 10.5 mm.

        Parameters
        ----------
        at, rotate, directivity, level, source_strength, piston_radius, wave
            As of `grid`.

        Returns
        -------
        Array

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

        Returns
        -------
        Array

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

    @classmethod
    def of_scene(cls, scene, set=None):
        """The array that a scene describes, without meshing its body.

        Parameters
        ----------
        scene : str, os.PathLike or dict
            A file, YAML text, or a dict.
        set : dict, optional
            Changes of the scene by key path.

        Returns
        -------
        Array

        Examples
        --------
        >>> array = tf.Array.of_scene("scenes/quick.yaml")
        """
        from ._scenes import changes, source

        return cls._of(_core.Array.of_scene(source(scene), changes(set)))

    @property
    def positions(self):
        """Shape (N, 3) [m]."""
        return self._core.positions

    @property
    def normals(self):
        """Unit vectors along which the transducers emit, shape (N, 3)."""
        return self._core.normals

    @property
    def strengths(self):
        """Pressure times distance at full drive [Pa m], shape (N,); of a plane wave [Pa]."""
        return self._core.strengths

    def field(self, points, drives, wave=None):
        """The pressure in free air, without a body.

        Parameters
        ----------
        points : array_like, shape (..., 3)
            [m]
        drives : array_like of complex, shape (N,) or (N, S), or Solution
            Amplitudes 0 to 1 and phases of the channels; S columns are S drive vectors.
        wave : Wave, optional
            Default: ``Wave()``.

        Returns
        -------
        numpy.ndarray of complex, shape (...) or (..., S)
            [Pa]; NaN on a transducer.

        Examples
        --------
        >>> array = tf.Array.grid(16, 16)
        >>> pressure = array.field([[0, 0, 0.15]], array.focus([0, 0, 0.15]))
        >>> abs(pressure).round().tolist()
        [6592.0]
        """
        flat, shape = _rows(points)
        values = self._core.field(flat, drives_of(drives), wave_core(wave))
        return values.reshape(*shape, values.shape[1]) if np.ndim(drives_of(drives)) == 2 else values.reshape(shape)

    def transfer(self, points, wave=None):
        """The transfer matrix of points in free air.

        Parameters
        ----------
        points : array_like, shape (J, 3)
            [m]
        wave : Wave, optional
            Default: ``Wave()``.

        Returns
        -------
        numpy.ndarray of complex, shape (J, N)
            Pressure of each channel at full drive [Pa].

        Examples
        --------
        >>> tf.Array.grid(16, 16).transfer([[0, 0, 0.15], [0, 0, 0.16]]).shape
        (2, 256)
        """
        return self._core.transfer(points, wave_core(wave))

    def focus(self, point, wave=None):
        """Phases with which the sound of all channels arrives in phase at a point in free air.

        Parameters
        ----------
        point : array_like, shape (3,)
            [m]
        wave : Wave, optional
            Default: ``Wave()``.

        Returns
        -------
        Solution

        Examples
        --------
        >>> phases = tf.Array.grid(16, 16).focus([0, 0, 0.15]).phases
        """
        from ._phases import Solution

        return Solution._of(_core.focus(self.transfer([point], wave)[0]))

    def _scene_keys(self):
        if self._keys is not None:
            return self._keys
        plane, positions, axes, strengths, directivity, ka, _, _, gain, phase = self._core.__getstate__()
        layout = {"positions": {"points_mm": millimetres(positions), "axes": axes.tolist()}}
        if self._given is not None:
            return layout | self._given
        if plane:
            return {"plane_wave": {"direction": axes[0].tolist(), "amplitude_pa": float(strengths[0])}}
        if np.ptp(strengths) != 0:
            raise _core.InputError("array: its channels have different strengths, which a scene cannot say")
        keys = layout | {"directivity": directivity, "source_pa_m": float(strengths[0])}
        if directivity == "piston":
            keys["piston_radius_mm"] = 1e3 * ka / Wave().k
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
        colours = {} if drives is None else {"c": np.angle(drives_of(drives)), "cmap": "twilight", "vmin": -np.pi, "vmax": np.pi}
        ax.scatter(1e3 * self.positions[:, 0], 1e3 * self.positions[:, 1], s=20, **colours)
        ax.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
        return ax

    def __len__(self):
        return len(self._core)


def _rows(points):
    """Points as rows, and the shape that belongs to their values."""
    points = np.asarray(points)
    if points.ndim > 2:
        return points.reshape(-1, points.shape[-1]), points.shape[:-1]
    return points, points.shape[:1]
