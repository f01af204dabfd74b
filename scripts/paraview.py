"""Shows the results of a run or a moving body in ParaView, with one colour scale.

    pvpython scripts/paraview.py RESULTS -o picture.png          the skin seen from the array, one view per method
    pvpython scripts/paraview.py MOTION --motion film.ogv        the same over the time of a motion; also .avi, or .png for frames

On a machine without a display, use xvfb-run -a pvpython scripts/paraview.py ...
"""

import argparse
import math
import os
import sys
import xml.etree.ElementTree

PANEL = (420, 600)  # size of a view [pixels]
TITLE_HEIGHT = 40
BAR_WIDTH = 180  # a multiple of four, as PANEL: films require it
OUTLINE_LIFT = 4e-4  # [m] towards the array, so that adjacent faces do not cover half of the outline
MARGIN = 0.92  # share of a view that the skin fills
TOP_SHARE = 0.999  # the colour scale ends here, so that a single face with a high pressure does not darken all others
SUFFIX = "_abs_pa"
INK = [0.1, 0.1, 0.1]
FILMS = (".png", ".avi", ".ogv")


class RunError(Exception):
    """An error that the caller can correct."""


def need_paraview():
    """Imports ParaView. Arguments and files are checked before, because that does not need ParaView."""
    global numpy, servermanager, simple, vtk_to_numpy
    # This file has the name of the package it needs: its own folder must not be searched first.
    sys.path = [p for p in sys.path if not os.path.isfile(os.path.join(p or ".", "paraview.py"))]
    try:
        import numpy
        from paraview import servermanager, simple
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkRenderingCore import vtkRenderWindow
    except ImportError as missing:
        raise RunError(f"this Python has no ParaView ({missing}): use pvpython") from missing
    if vtkRenderWindow().GetClassName() == "vtkXOpenGLRenderWindow" and not os.environ.get("DISPLAY"):
        raise RunError("there is no display: use xvfb-run -a pvpython")


def face_values(skin):
    """{name: values of the faces}, of the target and of the methods in the order of the scene."""
    arrays = skin.GetCellData()
    names = [arrays.GetArrayName(i) for i in range(arrays.GetNumberOfArrays())]
    return {name: vtk_to_numpy(arrays.GetArray(name)) for name in names if name == "target_pa" or name.endswith(SUFFIX)}


def top_of(values):
    finite = values[numpy.isfinite(values)]
    return float(numpy.quantile(finite, TOP_SHARE, method="higher")) if len(finite) else 0.0


def show_skin(surface, method, top, view):
    display = simple.Show(surface, view)
    display.Interpolation = "Flat"
    display.Ambient, display.Diffuse, display.Specular = 0.7, 0.3, 0.0
    simple.ColorBy(display, ("CELLS", method + SUFFIX))
    colours = simple.GetColorTransferFunction(method + SUFFIX)
    colours.ApplyPreset("Viridis (matplotlib)", True)
    colours.RescaleTransferFunction(0.0, top or 1.0)
    display.SetScalarBarVisibility(view, False)


def show_outline(surface, sight, view):
    """The border of the target as a red line."""
    inside = simple.Threshold(registrationName="target", Input=surface, Scalars=["CELLS", "target_pa"])
    inside.ThresholdMethod, inside.UpperThreshold = "Above Upper Threshold", sys.float_info.min
    edges = simple.FeatureEdges(registrationName="target outline", Input=simple.ExtractSurface(Input=inside))
    edges.BoundaryEdges, edges.FeatureEdges, edges.NonManifoldEdges, edges.ManifoldEdges = True, False, False, False
    display = simple.Show(edges, view)
    display.ColorArrayName = ["POINTS", ""]  # one colour
    display.AmbientColor = display.DiffuseColor = [0.92, 0.12, 0.24]
    display.LineWidth = 2.5
    display.Ambient, display.Diffuse = 1.0, 0.0
    display.Position = (-OUTLINE_LIFT * sight.axes[2]).tolist()


def file_of(results, name):
    path = os.path.join(results, name)
    if not os.path.isfile(path):
        moving = os.path.isfile(os.path.join(results, "evaluation.pvd"))
        raise RunError(f"{path} is missing: " + ("for a moving body, use --motion FILM" if moving else "add vtp to write in the scene"))
    return path


def series_of(path):
    """The times and files that a .pvd lists."""
    try:
        steps = xml.etree.ElementTree.parse(path).getroot().findall("Collection/DataSet")
        series = [(float(step.attrib["timestep"]), step.attrib["file"]) for step in steps]
    except (OSError, xml.etree.ElementTree.ParseError, KeyError, ValueError) as error:
        raise RunError(f"{path} is not a ParaView series: {error}") from error
    if not series:
        raise RunError(f"{path} lists no file")
    for (before, _), (after, file) in zip(series, series[1:]):
        if not before < after:
            raise RunError(f"{path}: the time {after:g} of {file} must be later than {before:g}")
    series = [(time, os.path.join(os.path.dirname(path), file)) for time, file in series]
    for _, file in series:
        if not os.path.isfile(file):
            raise RunError(f"{file}, which {path} lists, is missing")
    return series


def frames_a_second(series):
    """Frames per second of a film at the speed of the motion."""
    return max(1, round((len(series) - 1) / (series[-1][0] - series[0][0]))) if len(series) > 1 else 1


def round_above(value):
    """A round number at or above the value, as for the colour scales in the pictures of a run."""
    if not 0 < value < math.inf:
        return 1.0
    unit = 10.0 ** math.floor(math.log10(value))
    return next((step * unit for step in (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8) if value <= step * unit * (1 + 1e-9)), 10 * unit)


def axes_of(array):
    """Axes of the views: to the left, up (+y of the world, or +x), and the direction in which the array faces."""
    along = vtk_to_numpy(servermanager.Fetch(array).GetPointData().GetArray("axis")).astype(float).mean(axis=0)
    length = numpy.linalg.norm(along)
    along = along / length if length > 1e-3 else numpy.array([0.0, 0.0, 1.0])
    up = numpy.array([0.0, 1.0, 0.0] if abs(along[1]) < 0.99 else [1.0, 0.0, 0.0])
    up -= along @ up * along
    up /= numpy.linalg.norm(up)
    return numpy.array([numpy.cross(along, up), up, along])


class Sight:
    """The parallel projection that all views of a figure share. It shows the skin, or only the surroundings of the target."""

    def __init__(self, array, skins, around_mm):
        self.axes = axes_of(array)
        loudest, wanted, ends = 0.0, 0.0, []
        for skin in skins:
            points, values = vtk_to_numpy(skin.GetPoints().GetData()), face_values(skin)
            target = values.get("target_pa", numpy.zeros(1))
            wanted = max(wanted, float(target.max()))
            loudest = max([loudest] + [top_of(own) for name, own in values.items() if name.endswith(SUFFIX)])
            if around_mm is not None:
                faces = vtk_to_numpy(skin.GetPolys().GetConnectivityArray()).reshape(-1, 3)
                points = points[faces[target > 0].ravel()] if "target_pa" in values else points[:0]
            if len(points) > 0:
                across = points @ self.axes.T
                ends += [across.min(axis=0), across.max(axis=0)]
        if not ends:
            raise RunError("--around-mm: the skin has no target")
        least, most = numpy.min(ends, axis=0), numpy.max(ends, axis=0)
        self.centre = (least + most) / 2 @ self.axes
        self.extent = most - least + 2e-3 * (around_mm or 0)
        self.top = round_above(2 * wanted if wanted > 0 else loudest)

    def place(self, view):
        width, height = PANEL
        view.CameraParallelProjection = 1
        view.CameraParallelScale = float(max(self.extent[1], self.extent[0] * height / width)) / 2 / MARGIN
        view.CameraFocalPoint = self.centre.tolist()
        view.CameraPosition = (self.centre - self.axes[2]).tolist()  # 1 m away: only clipping depends on it
        view.CameraViewUp = self.axes[1].tolist()


def white_view(layout, cell, text=None):
    view = simple.CreateView("RenderView")
    view.UseColorPaletteForBackground = 0
    view.Background = [1.0, 1.0, 1.0]
    view.OrientationAxesVisibility = 0
    simple.AssignViewToLayout(view, layout, cell)
    if text is not None:
        display = simple.Show(text, view)
        display.Color, display.FontSize, display.WindowLocation = INK, 17, "Upper Center"
    return view


def figure(results, skin, array, skins, asked, around_mm, clock=None):
    """A layout and its size. It has one view per method with the name above it, and one colour bar for all views."""
    known = face_values(servermanager.Fetch(skin))
    methods = [name[:-len(SUFFIX)] for name in known if name.endswith(SUFFIX)]
    for method in asked:
        if method not in methods:
            raise RunError(f"{results} has no method {method}, only {', '.join(methods) or 'the skin'}")
    methods = asked or methods
    if not methods:
        raise RunError(f"{results} has no pressures of methods")
    sight = Sight(array, skins, around_mm)
    size = [len(methods) * PANEL[0] + BAR_WIDTH, PANEL[1] + TITLE_HEIGHT]
    layout = simple.CreateLayout("figure")
    layout.SetSize(*size)
    cell = layout.SplitHorizontal(0, 1 - BAR_WIDTH / size[0])
    for left, method in zip(range(len(methods), 0, -1), methods):
        panel = layout.SplitHorizontal(cell, 1 / left) if left > 1 else cell
        cell = panel + 1
        title = layout.SplitVertical(panel, TITLE_HEIGHT / size[1])
        white_view(layout, title, simple.Text(Text=method))
        view = white_view(layout, title + 1)
        show_skin(skin, method, sight.top, view)
        if "target_pa" in known:
            show_outline(skin, sight, view)
        sight.place(view)
    side = white_view(layout, 2, clock)
    bar = simple.GetScalarBar(simple.GetColorTransferFunction(methods[0] + SUFFIX), side)
    bar.Title, bar.ComponentTitle = "abs(p) [Pa]", ""
    bar.TitleColor = bar.LabelColor = INK
    bar.Visibility, bar.WindowLocation = 1, "Any Location"
    bar.Position, bar.ScalarBarLength, bar.ScalarBarThickness = [0.12, 0.12], 0.7, 22
    bar.HorizontalTitle, bar.TitleFontSize, bar.LabelFontSize = 1, 14, 14
    bar.RangeLabelFormat = bar.LabelFormat = "%.5g"
    return layout, size


def draw(results, picture, asked, around_mm):
    """Writes the figure of a run as one picture."""
    surface, array = (file_of(results, name) for name in ("surface.vtp", "array.vtp"))
    need_paraview()
    skin = simple.XMLPolyDataReader(FileName=[surface])
    source = simple.XMLPolyDataReader(FileName=[array])
    layout, size = figure(results, skin, source, [servermanager.Fetch(skin)], asked, around_mm)
    simple.SaveScreenshot(picture, layout, ImageResolution=size, SeparatorWidth=0)


def play(results, film, asked, around_mm):
    """Writes the figure over the time of a motion, as numbered pictures or a film."""
    path, array = (file_of(results, name) for name in ("evaluation.pvd", "array.vtp"))
    series = series_of(path)
    need_paraview()
    skin = simple.PVDReader(FileName=path)
    source = simple.XMLPolyDataReader(FileName=[array])
    skins = []
    for _, file in series:
        step = simple.XMLPolyDataReader(FileName=[file])
        skins.append(servermanager.Fetch(step))
        simple.Delete(step)
    clock = simple.AnnotateTimeFilter(Input=skin, Format="{time:.3f} s")
    layout, size = figure(results, skin, source, skins, asked, around_mm, clock)
    animation = simple.GetAnimationScene()
    animation.UpdateAnimationUsingDataTimeSteps()
    animation.PlayMode = "Snap To TimeSteps"
    options = {} if film.endswith(".png") else {"FrameRate": frames_a_second(series)}
    simple.SaveAnimation(film, layout, ImageResolution=size, SeparatorWidth=0, FrameWindow=[0, len(series) - 1], **options)


def ending(allowed):
    def check(name):
        if os.path.splitext(name)[1] not in allowed:
            raise argparse.ArgumentTypeError(f"{name} must end in {', '.join(allowed)}")
        if not os.path.isdir(os.path.dirname(name) or "."):
            raise argparse.ArgumentTypeError(f"the folder {os.path.dirname(name)} does not exist")
        return name
    return check


def above_zero(text):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text} must be a number > 0")
    return value


def parse_arguments(words):
    parser = argparse.ArgumentParser(prog="paraview.py", description="Shows a run or a moving body in ParaView.", allow_abbrev=False)
    parser.add_argument("results", help="directory of a run (touchfield run) or of a moving body (touchfield play)")
    parser.add_argument("-o", "--output", metavar="PNG", type=ending([".png"]),
                        help="write a picture of the skin seen from the array, with one view per method")
    parser.add_argument("--motion", metavar="FILM", type=ending(FILMS),
                        help="write the motion as a film (.avi or .ogv) or as numbered pictures (.png), one per instant")
    parser.add_argument("--method", action="append", default=[], help="method to show (default: all); may be repeated")
    parser.add_argument("--around-mm", type=above_zero,
                        help="show only the target and this much of the skin around it")
    arguments = parser.parse_args(words)
    if not os.path.isdir(arguments.results):
        parser.error(f"{arguments.results} is not a directory")
    if bool(arguments.output) == bool(arguments.motion):
        parser.error("use one of -o and --motion per call")
    return arguments


def main():
    arguments = parse_arguments(sys.argv[1:])
    try:
        if arguments.output:
            draw(arguments.results, arguments.output, arguments.method, arguments.around_mm)
        else:
            play(arguments.results, arguments.motion, arguments.method, arguments.around_mm)
    except RunError as error:
        sys.exit(f"paraview.py: {error}")


if __name__ == "__main__":
    main()
