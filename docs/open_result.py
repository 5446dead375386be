"""Opens a result folder of hvi_fenicsx in ParaView: the body warped by its displacement, Γc coloured, Γc plotted.

In ParaView: ``HVI_RESULT=FOLDER paraview --script=open_result.py``. Without a window: ``pvpython open_result.py FOLDER
[--picture FILE.png]``.
"""

import csv
import os
import sys

from paraview import simple as pv

WARPS = ("displacement", "escape_mode")
STRESS = "von_mises"
"""What colours the body, by cell, where it is there."""
COLOURS = {2: ("contact", "contact: 1, lifted: 0"), 3: ("sigma_n", "sigma_n / (N/m²)")}
"""What colours Γc, by dimension, and its title."""
CURVES = ("u_t1", "friction_t1", "sigma_n")
"""Columns of contact.csv that are plotted over s, in the plane."""
DRAWN = 0.08
"""How large the largest displacement is drawn, of the body's size."""


def size(bounds):
    """Largest extent of a box."""
    return max(bounds[1] - bounds[0], bounds[3] - bounds[2], bounds[5] - bounds[4])


def open_body(folder, view):
    """The warped body over its undeformed outline; the vector that warps it, its factor, and the dimension."""
    body = pv.PVDReader(registrationName="body", FileName=os.path.join(folder, "displacement.pvd"))
    body.UpdatePipeline()
    vector = next(name for name in WARPS if body.PointData.GetArray(name))
    information, bounds = body.PointData[vector], body.GetDataInformation().GetBounds()
    largest = information.GetRange(-1)[1]
    factor = DRAWN * size(bounds) / largest if largest > 0 else 1.0
    dimension = 3 if bounds[5] > bounds[4] else 2
    outline = pv.Show(body, view)
    outline.Representation, outline.Opacity = "Wireframe", 0.08
    warped = pv.WarpByVector(registrationName="deformed", Input=body)
    warped.Vectors, warped.ScaleFactor = ["POINTS", vector], factor
    shown = pv.Show(warped, view)
    if body.CellData.GetArray(STRESS):
        pv.ColorBy(shown, ("CELLS", STRESS))
    else:
        pv.ColorBy(shown, ("POINTS", vector, "Magnitude"))
    shown.SetScalarBarVisibility(view, True)
    return vector, factor, dimension


def open_contact(folder, view, dimension):
    """Γc, coloured, as a thick line or a surface."""
    file = os.path.join(folder, "contact.pvd")
    if not os.path.exists(file):
        return
    name, title = COLOURS[dimension]
    contact = pv.PVDReader(registrationName="contact", FileName=file)
    shown = pv.Show(contact, view)
    pv.ColorBy(shown, ("POINTS", name))
    shown.LineWidth, shown.Ambient, shown.Diffuse = 6, 1.0, 0.0  # the scale's own colours, from wherever it is seen
    shown.SetScalarBarVisibility(view, True)
    colours = pv.GetColorTransferFunction(name)
    if name == "contact":
        colours.RescaleTransferFunction(0.0, 1.0)
    bar = pv.GetScalarBar(colours, view)
    bar.Title, bar.ComponentTitle = title, ""


def plot_contact(folder, layout):
    """The table of Γc over the arc length, each curve in a view of its own; nothing in space."""
    file = os.path.join(folder, "contact.csv")
    table = pv.CSVReader(registrationName="table", FileName=[file])
    with open(file, encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    names = [name for name in CURVES if all(row[name] for row in rows)]
    cell = layout.SplitHorizontal(0, 0.6) + 1
    for i, name in enumerate(names):
        first = layout.SplitVertical(cell, 1.0 / (len(names) - i)) if name != names[-1] else cell
        view = pv.CreateView("XYChartView")
        layout.AssignView(first, view)
        cell = first + 1
        curve = pv.Show(table, view, "XYChartRepresentation")
        curve.UseIndexForXAxis, curve.XArrayName, curve.SeriesVisibility = 0, "s", [name]
        view.BottomAxisTitle, view.LeftAxisTitle, view.ShowLegend = "s / m", name, 0


def main(arguments):
    """Open the folder of the arguments, or that of HVI_RESULT."""
    folder = arguments[0] if arguments else os.environ.get("HVI_RESULT", os.path.join("results", "wall_left"))
    pv.LoadPalette("WhiteBackground")
    view = pv.GetActiveViewOrCreate("RenderView")
    layout = pv.GetLayout(view)
    vector, factor, dimension = open_body(folder, view)
    open_contact(folder, view, dimension)
    if dimension == 3:  # from the front and below, where contact parts mostly are
        view.CameraFocalPoint, view.CameraPosition, view.CameraViewUp = (0, 0, 0), (1.2, -2, -0.9), (0, 0, 1)
    view.ResetCamera(True)
    if dimension == 2 and os.path.exists(os.path.join(folder, "contact.csv")):
        plot_contact(folder, layout)
    pv.RenderAllViews()
    print(f"{folder}: {vector} x {factor:.3g}")
    if "--picture" in arguments:
        layout.SetSize(1800, 900)
        pv.SaveScreenshot(arguments[arguments.index("--picture") + 1], layout)


main(sys.argv[1:])
