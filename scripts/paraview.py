"""Shows the results of a run or a moving body in ParaView, with one colour scale.

    pvpython scripts/paraview.py RESULTS -o picture.png          the skin seen from the array, one view per method
    pvpython scripts/paraview.py MOTION --motion film.ogv        the same over the time of a motion; also .avi, or .png for frames

On a machine without a display, use xvfb-run -a pvpython scripts/paraview.py ...
"""

import argparse
import math
import os
import sys

import paraview_figure

FILMS = (".png", ".avi", ".ogv")


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
    parser.add_argument("--fps", type=above_zero,
                        help="frames per second of the film (default: the speed of the motion)")
    arguments = parser.parse_args(words)
    if not os.path.isdir(arguments.results):
        parser.error(f"{arguments.results} is not a directory")
    if bool(arguments.output) == bool(arguments.motion):
        parser.error("use one of -o and --motion per call")
    if arguments.fps and not (arguments.motion and not arguments.motion.endswith(".png")):
        parser.error("--fps requires --motion with .avi or .ogv")
    return arguments


def main():
    arguments = parse_arguments(sys.argv[1:])
    try:
        if arguments.output:
            paraview_figure.draw(arguments.results, arguments.output, arguments.method, arguments.around_mm)
        else:
            paraview_figure.play(arguments.results, arguments.motion, arguments.method, arguments.around_mm, arguments.fps)
    except paraview_figure.RunError as error:
        sys.exit(f"paraview.py: {error}")


if __name__ == "__main__":
    main()
