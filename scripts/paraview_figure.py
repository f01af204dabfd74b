"""The skin of a run or a moving body seen from the array, with one ParaView view per method."""

import math
import os
import xml.etree.ElementTree

import paraview_scene as scene
from paraview_scene import INK, SUFFIX, RunError

PANEL = (420, 600)  # size of a view [pixels]
TITLE_HEIGHT = 40
BAR_WIDTH = 180  # a multiple of four, as PANEL: films require it
MOST_COLUMNS = 4
OUTLINE_LIFT = 4e-4  # [m] towards the array, so that adjacent faces do not cover half of the outline
MARGIN = 0.92  # share of a view that the skin fills


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
    along = scene.mean_axis(array) if array else [0.0, 0.0, 1.0]
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
            points = scene.vtk_to_numpy(skin.GetPoints().GetData())
            arrays = skin.GetCellData()
            target = arrays.GetArray("target_pa")
            names = [arrays.GetArrayName(i) for i in range(arrays.GetNumberOfArrays())]
            self.top = max([self.top] + [scene.quantile(scene.vtk_to_numpy(arrays.GetArray(name)).tolist(), scene.TOP_SHARE)
                                         for name in names if name.endswith(SUFFIX)])
            pressed = []
            if target is not None:
                amplitudes = scene.vtk_to_numpy(target)
                wanted = max(wanted, float(amplitudes.max()))
                faces = scene.vtk_to_numpy(skin.GetPolys().GetConnectivityArray()).reshape(-1, 3)
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
    view = scene.simple.CreateView("RenderView")
    view.UseColorPaletteForBackground = 0
    view.Background = [1.0, 1.0, 1.0]
    view.OrientationAxesVisibility = 0
    scene.simple.AssignViewToLayout(view, layout, cell)
    if text is not None:
        display = scene.simple.Show(text, view)
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
    layout = scene.simple.CreateLayout("figure")
    layout.SetSize(*size)
    layout.SplitHorizontal(0, 1 - BAR_WIDTH / size[0])
    panels = panels_of(layout, 1, columns, rows)
    for method, panel in zip(methods, panels):
        title = layout.SplitVertical(panel, TITLE_HEIGHT / (PANEL[1] + TITLE_HEIGHT))
        white_view(layout, title, scene.simple.Text(Text=method))
        view = white_view(layout, title + 1)
        scene.show_skin(skin, method, view)
        outline = scene.show_outline(skin, view)
        if outline is not None:
            outline.Position = [-OUTLINE_LIFT * a for a in sight.along]
        scene.set_colours(method, sight.top, view)
        scene.simple.GetDisplayProperties(skin, view).SetScalarBarVisibility(view, False)
        sight.place(view)
    for panel in panels[len(methods):]:
        white_view(layout, panel)
    side = white_view(layout, 2, clock)
    bar = scene.simple.GetScalarBar(scene.simple.GetColorTransferFunction(methods[0] + SUFFIX), side)
    scene.name_bar(bar, "abs(p) [Pa]")
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
    surface, array = scene.skin_and_array(results)
    scene.need_paraview()
    skin = scene.simple.XMLPolyDataReader(FileName=[surface])
    source = scene.simple.XMLPolyDataReader(FileName=[array])
    methods = chosen(scene.methods_of(skin, "CELLS"), asked, results)
    layout, size = figure(skin, source, [scene.servermanager.Fetch(skin)], methods, around_mm)
    scene.simple.SaveScreenshot(picture, layout, ImageResolution=size, SeparatorWidth=0)


def play(results, film, asked, around_mm, rate):
    """Writes the figure over the time of a motion, as numbered pictures or a film."""
    path = os.path.join(results, "evaluation.pvd")
    series = series_of(path)
    scene.need_paraview()
    skin = scene.simple.PVDReader(FileName=path)
    array = os.path.join(results, "array.vtp")
    source = scene.simple.XMLPolyDataReader(FileName=[array]) if os.path.isfile(array) else None  # missing before 0.2
    skins = []
    for _, file in series:
        step = scene.simple.XMLPolyDataReader(FileName=[file])
        skins.append(scene.servermanager.Fetch(step))
        scene.simple.Delete(step)
    methods = chosen(scene.methods_of(skin, "CELLS"), asked, results)
    clock = scene.simple.AnnotateTimeFilter(Input=skin, Format="{time:.3f} s")
    layout, size = figure(skin, source, skins, methods, around_mm, clock)
    animation = scene.simple.GetAnimationScene()
    animation.UpdateAnimationUsingDataTimeSteps()
    animation.PlayMode = "Snap To TimeSteps"
    options = {} if film.endswith(".png") else {"FrameRate": rate or frames_a_second(series)}
    scene.simple.SaveAnimation(film, layout, ImageResolution=size, SeparatorWidth=0, FrameWindow=[0, len(series) - 1], **options)
