"""Shows a run as a ParaView scene: skin, target, array and fields, with one colour scale. In the Python shell of ParaView:

    import sys; sys.path.append("scripts")
    from paraview_scene import load
    load("results/runs/width_5mm-0001", method="surface")
"""

import glob
import math
import os
import sys

TOP_SHARE = 0.999  # the colour scale ends here, so that a single face with a high pressure does not darken all others
PRESSURE_COLOURS = "Viridis (matplotlib)"
PHASE_COLOURS = "hsv"  # cyclic, as phases are
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


def array_names(source, association):
    """Names in the order of the file, which is that of the scene's methods."""
    data = servermanager.Fetch(source)
    arrays = data.GetCellData() if association == "CELLS" else data.GetPointData()
    return [arrays.GetArrayName(i) for i in range(arrays.GetNumberOfArrays())]


def methods_of(source, association):
    return [name[: -len(SUFFIX)] for name in array_names(source, association) if name.endswith(SUFFIX)]


def magnitudes(source, association, method):
    data = servermanager.Fetch(source)
    arrays = data.GetCellData() if association == "CELLS" else data.GetPointData()
    array = arrays.GetArray(method + SUFFIX)
    return [] if array is None else vtk_to_numpy(array).tolist()


def name_bar(bar, title):
    bar.Title, bar.ComponentTitle = title, ""
    bar.TitleColor = bar.LabelColor = INK
    bar.RangeLabelFormat = "%.4g"


def colour_pressure(display, association, method, view, bar):
    simple.ColorBy(display, (association, method + SUFFIX))
    display.SetScalarBarVisibility(view, bar)


def show_skin(surface, method, view):
    display = simple.Show(surface, view)
    display.Interpolation = "Flat"
    display.Ambient, display.Diffuse, display.Specular = 0.7, 0.3, 0.0
    if method in methods_of(surface, "CELLS"):
        colour_pressure(display, "CELLS", method, view, True)
    elif "target_pa" in array_names(surface, "CELLS"):
        simple.ColorBy(display, ("CELLS", "target_pa"))


def show_outline(surface, view):
    """The border of the target as a red line; None without a target."""
    if "target_pa" not in array_names(surface, "CELLS"):
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


def show_array(array, method, view):
    display = simple.Show(array, view)
    display.PointSize = 6.0
    display.RenderPointsAsSpheres = True
    name = f"{method}_phase_rad"
    if name in array_names(array, "POINTS"):
        simple.ColorBy(display, ("POINTS", name))
        colours = simple.GetColorTransferFunction(name)
        colours.ApplyPreset(PHASE_COLOURS, True)
        colours.RescaleTransferFunction(0.0, 2.0 * math.pi)
        name_bar(simple.GetScalarBar(colours, view), "phase of the channels [rad]")
        display.SetScalarBarVisibility(view, True)


def show_field(field, method, view):
    """Shows a plane without the inside of the body, or only the outline of a cube."""
    size = servermanager.Fetch(field).GetDimensions()
    if list(size).count(1) != 1:
        display = simple.Show(field, view)
        display.SetRepresentationType("Outline")
        display.AmbientColor = display.DiffuseColor = INK
        return
    air = simple.Threshold(registrationName="air", Input=field, Scalars=["POINTS", "inside"])
    air.ThresholdMethod, air.LowerThreshold, air.UpperThreshold = "Between", 0, 0
    display = simple.Show(air, view)
    display.Ambient, display.Diffuse, display.Specular = 1.0, 0.0, 0.0
    if method in methods_of(field, "POINTS"):
        colour_pressure(display, "POINTS", method, view, True)


def set_colours(method, top, view):
    colours = simple.GetColorTransferFunction(method + SUFFIX)
    colours.ApplyPreset(PRESSURE_COLOURS, True)
    colours.RescaleTransferFunction(0.0, top or 1.0)
    name_bar(simple.GetScalarBar(colours, view), "sound pressure amplitude [Pa]")


def mean_axis(array):
    axes = vtk_to_numpy(servermanager.Fetch(array).GetPointData().GetArray("axis"))
    axis = axes.mean(axis=0)
    length = math.sqrt(float(axis @ axis))
    return [float(a) / length for a in axis] if length > 1e-3 else [0.0, 0.0, 1.0]


def place_camera(view, array):
    """Looks from the side and a little below, with the array's axis up. The pressed side of the skin and the array are both visible."""
    up = mean_axis(array)
    side = [0.75, 0.65, 0.0] if abs(up[2]) > 0.5 else [0.0, 0.0, 1.0]
    along = sum(s * u for s, u in zip(side, up))
    side = [s - along * u for s, u in zip(side, up)]
    sight = [0.85 * s + 0.5 * u for s, u in zip(side, up)]
    view.CameraParallelProjection = 1
    view.CameraFocalPoint = [0.0, 0.0, 0.0]
    view.CameraPosition = [-s for s in sight]
    view.CameraViewUp = up
    simple.ResetCamera(view)


def skin_and_array(run_dir):
    paths = [os.path.join(run_dir, name) for name in ("surface.vtp", "array.vtp")]
    for path in paths:
        if not os.path.isfile(path):
            moving = os.path.isfile(os.path.join(run_dir, "evaluation.pvd"))
            raise RunError(f"{path} is missing: " + ("for a moving body, use --motion FILM" if moving
                                                     else "add vtp to write in the scene"))
    return paths


def load(run_dir, method=None):
    """Loads every file of a run and returns the view. It shows the pressure of `method`, by default the first one."""
    path = lambda name: os.path.join(run_dir, name)  # noqa: E731
    skin_path, array_path = skin_and_array(run_dir)
    need_paraview()
    surface = simple.XMLPolyDataReader(registrationName="surface", FileName=[skin_path])
    array = simple.XMLPolyDataReader(registrationName="array", FileName=[array_path])
    fields = [
        simple.XMLImageDataReader(registrationName=os.path.basename(name), FileName=[name])
        for name in sorted(glob.glob(glob.escape(path("")) + "*.vti"))
    ]
    for source in (surface, array, *fields):
        source.UpdatePipeline()
    methods = methods_of(surface, "CELLS")
    if method is None and methods:
        method = methods[0]
    if method is not None and method not in methods:
        raise RunError(f"{run_dir} has no method {method}, only {', '.join(methods) or 'the skin'}")

    view = simple.GetActiveViewOrCreate("RenderView")
    view.UseColorPaletteForBackground = 0
    view.Background = [1.0, 1.0, 1.0]
    view.OrientationAxesLabelColor = INK
    show_skin(surface, method, view)
    show_outline(surface, view)
    show_array(array, method, view)
    for field in fields:
        show_field(field, method, view)
    if os.path.isfile(path("evaluation.vtp")):
        simple.Hide(simple.XMLPolyDataReader(registrationName="evaluation", FileName=[path("evaluation.vtp")]), view)
    if method is not None:
        tops = [quantile(magnitudes(surface, "CELLS", method), TOP_SHARE)]
        tops += [quantile(magnitudes(field, "POINTS", method), TOP_SHARE) for field in fields]
        set_colours(method, max(tops), view)
    title = simple.Text(registrationName="title", Text=f"{os.path.basename(os.path.abspath(run_dir))}: {method or 'skin'}")
    simple.Show(title, view).Color = INK
    place_camera(view, array)
    simple.Render(view)
    return view
