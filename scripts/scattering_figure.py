"""Draws one method of a run as if the hand did not scatter, beside what really reaches its skin, and beside other methods.

usage: python scripts/scattering_figure.py RUN METHOD OTHER... -o PNG

RUN: the directory of a run with run.h5 and a target; METHOD: its phases are drawn twice, in free air (the incident field alone, at the
places where the skin is) and scattered by the hand. Needs the Python package (scripts/setup_python).
"""

import argparse
import pathlib
import shutil
import tempfile
import zlib

import h5py
import numpy
import touchfield


def skin_of(run):
    """The mesh and the target for which the metrics hold."""
    own = "evaluation" in run and isinstance(run["evaluation"].get("mesh", getlink=True), h5py.HardLink)
    return (run["evaluation/mesh"], run["evaluation/target"]) if own else (run["mesh"], run["target"])


def relative_error(area, pressure, target):
    wanted = numpy.zeros(len(area))
    wanted[target["face"][:]] = target["amplitude"][:]
    return (1 - numpy.sum(area * pressure * wanted) ** 2 / numpy.sum(area * pressure**2) / numpy.sum(area * wanted**2)) ** 0.5


def main():
    parser = argparse.ArgumentParser(description="Draws one method of a run in free air and on the hand, beside other methods.")
    parser.add_argument("run", type=pathlib.Path, help="directory of a run with run.h5 and a target")
    parser.add_argument("method", help="method that is drawn in free air and on the hand")
    parser.add_argument("others", nargs="*", help="other methods to draw on the hand")
    parser.add_argument("-o", "--output", required=True, metavar="PNG", help="picture to write")
    arguments = parser.parse_args()
    array = touchfield.Array.of_scene(str(arguments.run / "scene.yaml"))
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / "run.h5"
        shutil.copy(arguments.run / "run.h5", copy)
        with h5py.File(copy, "r+") as run:
            mesh, target = skin_of(run)
            method = run["methods"][arguments.method]
            drives = method["amplitude"][:] * numpy.exp(1j * method["phase"][:])
            corners = mesh["vertices"][:][mesh["triangles"][:]]
            free = array.field(corners.mean(axis=1), drives)
            kept = {}
            for name, source in {f"{arguments.method}_in_free_air": arguments.method, f"{arguments.method}_on_the_hand": arguments.method,
                                 **{other: other for other in arguments.others}}.items():
                kept[name] = (source, run[f"evaluation/methods/{source}/pressure"][:], dict(run["methods"][source].attrs))
            free_name = f"{arguments.method}_in_free_air"
            error = relative_error(mesh["area"][:], abs(free), target)
            kept[free_name] = (arguments.method, free, {**kept[free_name][2], "relative_error": error})
            write(run, kept)
        content = copy.read_bytes()
        copy.write_bytes(content + b"touchfield-crc32 %08x\n" % zlib.crc32(content))
        with open(arguments.output, "wb") as picture:
            picture.write(bytes(touchfield.read_run(str(copy)).picture("overview")))
        for name, (_, _, attributes) in kept.items():
            print(f"{name}: error {100 * attributes['relative_error']:.1f} %")


def write(run, kept):
    """Keeps only these methods, in this order, with these pressures on the evaluation mesh."""
    order = {name: source for name, (source, _, _) in kept.items()}
    parts = {source: {part: values[()] for part, values in run["methods"][source].items()
                      if part != "radiation"} for source in set(order.values())}  # all show |p|
    for group in {"field", "transfer"} & set(run):
        del run[group]
    for group in ["methods", "evaluation/methods"]:
        del run[group]
        run.create_group(group, track_order=True)
    for name, (source, pressure, attributes) in kept.items():
        group = run.create_group(f"methods/{name}", track_order=True)
        for key, value in attributes.items():
            group.attrs[key] = value
        for part, values in parts[source].items():
            group.create_dataset(part, data=values).attrs["unit"] = "1"
        run.create_dataset(f"evaluation/methods/{name}/pressure", data=pressure).attrs["unit"] = "Pa"


if __name__ == "__main__":
    main()
