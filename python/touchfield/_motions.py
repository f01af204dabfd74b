"""Scenes that move, and what cameras see of them."""

from . import _core, _display
from ._arrays import Array
from ._bodies import Mesh
from ._plain import Part, file_content, named, read_content
from ._progress import reporting
from ._scenes import changes, source


class Motion(Part):
    """The results of a scene that moves."""

    def __reduce__(self):
        return _motion_of_bytes, (file_content(self._core, "motion.h5"),)

    @property
    def name(self):
        """Of the scene."""
        return self._core.name

    @property
    def scene(self):
        """The scene as YAML with all defaults."""
        return self._core.scene

    @property
    def duration(self):
        """[s]"""
        return self._core.duration

    @property
    def mesh(self):
        """The skin at the beginning, as the solver sees it: a `Mesh`."""
        return Mesh._of(self._core.mesh)

    @property
    def array(self):
        """The transducers, an `Array`."""
        return Array._of(self._core.array)

    @property
    def methods(self):
        """Names of the methods."""
        return self._core.methods

    @property
    def warnings(self):
        """Anything that makes a result unreliable."""
        return self._core.warnings

    @property
    def notes(self):
        """Information about results that are reliable."""
        return self._core.notes

    @property
    def complete(self):
        """Whether the motion was played to its end."""
        return self._core.complete

    @property
    def scores(self):
        """By method: columns of the scores over time, as motion.csv has them, in s and m."""
        return {method: named(self._core.scores(method)) for method in self.methods}

    @property
    def frames(self):
        """By method: columns of the frames, as frames.csv has them, in s and m."""
        return {method: named(self._core.frames(method)) for method in self.methods}

    @property
    def phases(self):
        """By method, of every channel in each frame, shape (F, N) [rad]."""
        return {method: self._core.phases(method) for method in self.methods}

    @property
    def amplitudes(self):
        """By method, of every channel in each frame, shape (F, N)."""
        return {method: self._core.amplitudes(method) for method in self.methods}

    @property
    def summary(self):
        """By method: mean, median, 95th percentile and worst of every metric over the motion."""
        return {method: named(self._core.summary(method)) for method in self.methods}

    def save(self, path, force=False):
        """Writes a motion.h5.

        Parameters
        ----------
        path : str or os.PathLike
        force : bool
            Whether an older file is replaced.

        Examples
        --------
        >>> motion.save("motion.h5")  # doctest: +SKIP
        """
        self._core.save(path, force)

    def to_frame(self, of="scores"):
        """A `pandas.DataFrame` of all methods.

        Parameters
        ----------
        of : {"scores", "frames"}

        Examples
        --------
        >>> motion.to_frame().groupby("method").relative_error.median()  # doctest: +SKIP
        """
        import pandas

        tables = self.frames if of == "frames" else self.scores
        return pandas.concat([pandas.DataFrame(table).assign(method=method) for method, table in tables.items()], ignore_index=True)

    def plot(self, metric="relative_error", ax=None):
        """A metric over time, a line of each method.

        Parameters
        ----------
        metric : str
            A column of `scores`.
        ax : matplotlib.axes.Axes, optional
            Default: new ones.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> ax = motion.plot("mean_inside_pa")  # doctest: +SKIP
        """
        groups = [(method, table["time_s"], table[metric]) for method, table in self.scores.items()]
        return _display.lines(groups, ax, "time [s]", metric)

    def _repr_html_(self):
        columns = ("relative_error_median", "relative_error_p95", "mean_inside_pa_median", "frames", "late", "dropped")
        return _display.table({"method": self.methods} |
                              {name: [self.summary[method][name] for method in self.methods] for name in columns})


def _motion_of_bytes(content):
    return read_content(content, "motion.h5", read_motion)


def play(scene, out=None, set=None, device=None, *, force=False, threads=None, progress=None):
    """Plays the motion of a scene on the clock of its sensor, solver and array, as `touchfield play`.

    Parameters
    ----------
    scene : str, os.PathLike or dict
        A scene with `motion`, as of `Model`.
    out : str or os.PathLike, optional
        A folder for motion.h5, tables, pictures and surfaces; default: none is written.
    set : dict, optional
        Changes of the scene by key path.
    device : {"auto", "cpu", "cuda", "cuda:N"}, optional
    force : bool
        Whether older results in the folder are replaced.
    threads : int, optional
    progress : callable or bool, optional

    Returns
    -------
    Motion

    Raises
    ------
    InputError
        If the scene has no motion, or as of `run`.

    Examples
    --------
    >>> motion = tf.play("scenes/moving.yaml")  # doctest: +SKIP
    """
    with reporting(progress):
        return Motion._of(_core.play(source(scene), out, changes(set), device, force, threads))


def read_motion(path):
    """Reads a motion.h5.

    Parameters
    ----------
    path : str or os.PathLike

    Returns
    -------
    Motion

    Examples
    --------
    >>> motion = tf.read_motion("motion.h5")  # doctest: +SKIP
    """
    return Motion._of(_core.read_motion(path))


def see(scene, out, set=None, *, force=False, threads=None, progress=None):
    """Writes the depth images of a scene's simulated cameras into a folder, as `touchfield see`.

    Parameters
    ----------
    scene : str, os.PathLike or dict
        With `motion.sensor.cameras`.
    out : str or os.PathLike
    set : dict, optional
        Changes of the scene by key path.
    force : bool
        Whether older images in the folder are replaced.
    threads : int, optional
    progress : callable or bool, optional

    Returns
    -------
    list of dict
        Of each camera: `camera`, `pixels` per frame, `holes` (a share), `nearest` and `farthest` [m].

    Examples
    --------
    >>> tf.see("scenes/cameras.yaml", "images")  # doctest: +SKIP
    """
    with reporting(progress):
        return _core.see(source(scene), out, changes(set), force, threads)


def fit(folder, out, *, pose="auto", side="auto", length=193.3e-3, breadth=88.3e-3, edge=3e-3, learn=1.0, workspace=None, force=False,
        threads=None, progress=None):
    """Fits the built-in hand to recorded depth images, as `touchfield fit`, and writes meshes over time.

    Parameters
    ----------
    folder : str or os.PathLike
        Of depth images, cameras.yaml and times.csv, as `see` writes it.
    out : str or os.PathLike
        Gets meshes and tables, for ``body: {meshes: {folder, times, unit: m}}``.
    pose : {"auto", "flat", "index_up", "grasp", "point_down", "fist"}
    side : {"auto", "right", "left"}
    length, breadth : float
        Of the hand before its shape is learnt [m].
    edge : float
        Of the meshes [m].
    learn : float
        Time from which the shape is learnt [s]; 0: it is not learnt.
    workspace : array_like, shape (2, 3), optional
        Corners of the box in which the hand is searched [m].
    force : bool
        Whether older results in the folder are replaced.
    threads : int, optional
    progress : callable or bool, optional

    Returns
    -------
    dict
        `pose`, `side`, `shape_learnt`, `length_ratio`, `breadth_ratio`, `warnings`, and `frames`: columns.

    Examples
    --------
    >>> tf.fit("images", "hand")["frames"]["residual"]  # doctest: +SKIP
    """
    with reporting(progress):
        return _core.fit(folder, out, pose=pose, side=side, length=length, breadth=breadth, edge=edge, learn=learn, workspace=workspace,
                         force=force, threads=threads)
