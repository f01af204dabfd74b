"""The program touchfield, for wheels (scripts/wheel), which have it beside this file."""

import os
import pathlib
import sys


def main():
    os.execv(pathlib.Path(__file__).resolve().parent / "bin/touchfield", sys.argv)
