"""The skin of a run or a moving body seen from the array, with one ParaView view per method and one colour scale."""

import math
import os
import sys
import xml.etree.ElementTree

PANEL = (420, 600)  # size of a view [pixels]
TITLE_HEIGHT = 40
BAR_WIDTH = 180  # a multiple of four, as PANEL: films require it
MOST_COLUMNS = 4
OUTLINE_LIFT = 4e-4  # [m] towards the array, so that adjacent faces do not cover half of the outline
MARGIN = 0.92  # share of a view that the skin fills
TOP_SHARE = 0.999  # the colour scale ends here, so that a single face with a high pressure does not darken all others
SUFFIX = "_abs_pa"
INK = [0.1, 0.1, 0.1]


class RunError(Exception):
    """An error that the caller can correct."""


def need_paraview():
    """Imports ParaView. Arguments and files are checked before, because that does not need ParaView."""
    global servermanager, simple, vtk_to_numpy
    # This file has the name of the package it needs: its own folder must not be searched first.
    sys.path = [p for p in sys.path if not os.path.isfile(os.path.join(p or ".", "paraview.py"))]
    try:
        from paraview import servermanager, simple
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkRenderingCore import vtkRenderWindow
    except ImportError as missing:
        raise RunError(f"this Python has no ParaView ({missing}): use pvpython") from missing
    if vtkRenderWindow().GetClassName() == "vtkXOpenGLRenderWindow" and not os.environ.get("DISPLAY"):
        raise RunError("there is no display: use xvfb-run -a pvpython")


def quantile(values, share):
    values = sorted(v for v in values if math.isfinite(v))
    return values[min(len(values) - 1, math.ceil(share * (len(values) - 1)))] if values else 0.0


def array_names(source):
    """Names of the faces' values in the order of the file, which is that of the scene's methods."""
    arrays = servermanager.Fetch(source).GetCellData()
    return [arrays.GetArrayName(i) for i in range(arrays.GetNumberOfArrays())]


def methods_of(source):
    return [name[: -len(SUFFIX)] for name in array_names(source) if name.endswith(SUFFIX)]


def name_bar(bar, title):
    bar.Title, bar.ComponentTitle = title, ""
    bar.TitleColor = bar.LabelColor = INK
    bar.RangeLabelFormat = "%.4g"


def show_skin(surface, method, view):
    display = simple.Show(surface, view)
    display.Interpolation = "Flat"
    display.Ambient, display.Diffuse, display.Specular = 0.7, 0.3, 0.0
    simple.ColorBy(display, ("CELLS", method + SUFFIX))


def show_outline(surface, view):
    """The border of the target as a red line; None without a target."""
    if "target_pa" not in array_names(surface):
        return None
    inside = simple.Threshold(registrationName="target", Input=surface, Scalars=["CELLS", "target_pa"])
    inside.ThresholdMethod, inside.UpperThreshold = "Above Upper Threshold", sys.float_info.min
    edges = simple.FeatureEdges(registrationName="target outline", Input=simple.ExtractSurface(Input=inside))
    edges.BoundaryEdges, edges.FeatureEdges, edges.NonManifoldEdges, edges.ManifoldEdges = True, False, False, False
    display = simple.Show(edges, view)
    display.ColorArrayName = ["POINTS", ""]  # one colour
    display.AmbientColor = display.DiffuseColor = [0.92, 0.12, 0.24]
    display.LineWidth = 2.5
    display.Ambient, display.Diffuse = 1.0, 0.0
    return display


def set_colours(method, top, view):
    colours = simple.GetColorTransferFunction(method + SUFFIX)
    colours.ApplyPreset("Viridis (matplotlib)", True)
    colours.RescaleTransferFunction(0.0, top or 1.0)
    name_bar(simple.GetScalarBar(colours, view), "sound pressure amplitude [Pa]")


def mean_axis(array):
    axes = vtk_to_numpy(servermanager.Fetch(array).GetPointData().GetArray("axis"))
    axis = axes.mean(axis=0)
    length = math.sqrt(float(axis @ axis))
    return [float(a) / length for a in axis] if length > 1e-3 else [0.0, 0.0, 1.0]


def skin_and_array(run_dir):
    paths = [os.path.join(run_dir, name) for name in ("surface.vtp", "array.vtp")]
    for path in paths:
        if not os.path.isfile(path):
            moving = os.path.isfile(os.path.join(run_dir, "evaluation.pvd"))
            raise RunError(f"{path} is missing: " + ("for a moving body, use --motion FILM" if moving
                                                     else "add vtp to write in the scene"))
    return paths


def series_of(path):
    """The times and files that a .pvd lists."""
    try:
        steps = xml.etree.ElementTree.parse(path).getroot().findall("Collection/DataSet")
        series = [(float(step.attrib["timestep"]), step.attrib["file"]) for step in steps]
    except FileNotFoundError:
        raise RunError(f"{path} is missing: add vtp to write in the scene of the motion") from None
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


def grid(count):
    """Columns and rows for this number of views."""
    rows = math.ceil(count / MOST_COLUMNS)
    return math.ceil(count / rows), rows


def looking_from(array):
    """The direction in which the array faces, and the up direction of its view: +y of the world, or +x."""
    along = mean_axis(array) if array else [0.0, 0.0, 1.0]
    up = [0.0, 1.0, 0.0] if abs(along[1]) < 0.99 else [1.0, 0.0, 0.0]
    share = sum(a * u for a, u in zip(along, up))
    up = [u - share * a for a, u in zip(along, up)]
    length = math.sqrt(sum(u * u for u in up))
    return along, [u / length for u in up]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


class Sight:
    """The parallel projection that all views of a figure share. It shows the skin, or only the surroundings of the target."""

    def __init__(self, array, skins, around_mm):
        self.along, self.up = looking_from(array)
        self.axes = (cross(self.along, self.up), self.up, self.along)
        ends = []
        self.top = wanted = 0.0
        for skin in skins:
            points = vtk_to_numpy(skin.GetPoints().GetData())
            arrays = skin.GetCellData()
            target = arrays.GetArray("target_pa")
            names = [arrays.GetArrayName(i) for i in range(arrays.GetNumberOfArrays())]
            self.top = max([self.top] + [quantile(vtk_to_numpy(arrays.GetArray(name)).tolist(), TOP_SHARE)
                                         for name in names if name.endswith(SUFFIX)])
            pressed = []
            if target is not None:
                amplitudes = vtk_to_numpy(target)
                wanted = max(wanted, float(amplitudes.max()))
                faces = vtk_to_numpy(skin.GetPolys().GetConnectivityArray()).reshape(-1, 3)
                pressed = points[faces[amplitudes > 0].ravel()]
            if around_mm is not None and len(pressed) == 0:
                continue
            seen = pressed if around_mm is not None else points
            across = [seen @ axis for axis in self.axes]
            ends.append([(float(a.min()), float(a.max())) for a in across])
        if not ends:
            raise RunError("--around-mm: the skin has no target")
        least = [min(end[i][0] for end in ends) for i in range(3)]
        most = [max(end[i][1] for end in ends) for i in range(3)]
        middle = [(low + high) / 2 for low, high in zip(least, most)]
        self.centre = [sum(m * axis[i] for m, axis in zip(middle, self.axes)) for i in range(3)]
        self.extent = [high - low for low, high in zip(least, most)]
        if around_mm is not None:
            self.extent = [e + 2e-3 * around_mm for e in self.extent]
        self.top = round_above(2 * wanted if wanted > 0 else self.top)

    def place(self, view):
        width, height = PANEL
        view.CameraParallelProjection = 1
        view.CameraParallelScale = max(self.extent[1], self.extent[0] * height / width) / 2 / MARGIN
        view.CameraFocalPoint = self.centre
        view.CameraPosition = [c - a for c, a in zip(self.centre, self.along)]  # 1 m away: only clipping depends on it
        view.CameraViewUp = self.up


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


def panels_of(layout, cell, columns, rows):
    """Divides a cell of a layout into columns and rows. Returns the new cells row by row."""
    panels = []
    for left in range(rows, 0, -1):
        row = cell
        if left > 1:
            row = layout.SplitVertical(cell, 1 / left)
            cell = row + 1
        for column in range(columns, 1, -1):
            first = layout.SplitHorizontal(row, 1 / column)
            panels.append(first)
            row = first + 1
        panels.append(row)
    return panels


def figure(skin, array, skins, methods, around_mm, clock=None):
    """A layout and its size. It has one view per method with the name above it, and one colour bar for all views."""
    sight = Sight(array, skins, around_mm)
    columns, rows = grid(len(methods))
    size = [columns * PANEL[0] + BAR_WIDTH, rows * (PANEL[1] + TITLE_HEIGHT)]
    layout = simple.CreateLayout("figure")
    layout.SetSize(*size)
    layout.SplitHorizontal(0, 1 - BAR_WIDTH / size[0])
    panels = panels_of(layout, 1, columns, rows)
    for method, panel in zip(methods, panels):
        title = layout.SplitVertical(panel, TITLE_HEIGHT / (PANEL[1] + TITLE_HEIGHT))
        white_view(layout, title, simple.Text(Text=method))
        view = white_view(layout, title + 1)
        show_skin(skin, method, view)
        outline = show_outline(skin, view)
        if outline is not None:
            outline.Position = [-OUTLINE_LIFT * a for a in sight.along]
        set_colours(method, sight.top, view)
        simple.GetDisplayProperties(skin, view).SetScalarBarVisibility(view, False)
        sight.place(view)
    for panel in panels[len(methods):]:
        white_view(layout, panel)
    side = white_view(layout, 2, clock)
    bar = simple.GetScalarBar(simple.GetColorTransferFunction(methods[0] + SUFFIX), side)
    name_bar(bar, "abs(p) [Pa]")
    bar.Visibility, bar.WindowLocation = 1, "Any Location"
    bar.Position, bar.ScalarBarLength, bar.ScalarBarThickness = [0.12, 0.12], 0.7, 22
    bar.HorizontalTitle, bar.TitleFontSize, bar.LabelFontSize = 1, 14, 14
    bar.RangeLabelFormat = bar.LabelFormat = "%.5g"
    return layout, size


def chosen(methods, asked, results):
    for method in asked:
        if method not in methods:
            raise RunError(f"{results} has no method {method}, only {', '.join(methods) or 'the skin'}")
    if not methods:
        raise RunError(f"{results} has no pressures of methods")
    return asked or methods


def draw(results, picture, asked, around_mm):
    """Writes the figure of a run as one picture."""
    surface, array = skin_and_array(results)
    need_paraview()
    skin = simple.XMLPolyDataReader(FileName=[surface])
    source = simple.XMLPolyDataReader(FileName=[array])
    methods = chosen(methods_of(skin), asked, results)
    layout, size = figure(skin, source, [servermanager.Fetch(skin)], methods, around_mm)
    simple.SaveScreenshot(picture, layout, ImageResolution=size, SeparatorWidth=0)


def play(results, film, asked, around_mm, rate):
    """Writes the figure over the time of a motion, as numbered pictures or a film."""
    path = os.path.join(results, "evaluation.pvd")
    series = series_of(path)
    need_paraview()
    skin = simple.PVDReader(FileName=path)
    array = os.path.join(results, "array.vtp")
    source = simple.XMLPolyDataReader(FileName=[array]) if os.path.isfile(array) else None  # missing before 0.2
    skins = []
    for _, file in series:
        step = simple.XMLPolyDataReader(FileName=[file])
        skins.append(servermanager.Fetch(step))
        simple.Delete(step)
    methods = chosen(methods_of(skin), asked, results)
    clock = simple.AnnotateTimeFilter(Input=skin, Format="{time:.3f} s")
    layout, size = figure(skin, source, skins, methods, around_mm, clock)
    animation = simple.GetAnimationScene()
    animation.UpdateAnimationUsingDataTimeSteps()
    animation.PlayMode = "Snap To TimeSteps"
    options = {} if film.endswith(".png") else {"FrameRate": rate or frames_a_second(series)}
    simple.SaveAnimation(film, layout, ImageResolution=size, SeparatorWidth=0, FrameWindow=[0, len(series) - 1], **options)
