"""Progress of a computation, told to a function or shown by tqdm."""

import sys

from . import _core


def _bar():
    """A bar of tqdm, or a line on standard error where it is not installed."""
    try:
        from tqdm.auto import tqdm
    except ImportError:

        def line(stage, fraction):
            sys.stderr.write(f"\r{stage} {100 * fraction:3.0f} %\x1b[K")

        return line, lambda: sys.stderr.write("\n")
    bar = tqdm(total=1.0, bar_format="{desc} {percentage:3.0f} % |{bar}| {elapsed}", leave=False)

    def show(stage, fraction):
        bar.set_description_str(stage, refresh=False)
        bar.n = fraction
        bar.refresh()

    return show, bar.close


class reporting:
    """While it lasts, computations of this thread report to `progress`: a function of stage and fraction, True for a bar,
    None for nobody."""

    def __init__(self, progress):
        if not (progress is None or isinstance(progress, bool) or callable(progress)):
            raise TypeError(f"progress must be a function of stage and fraction, True or None, not {type(progress).__name__}")
        self.progress = progress
        self.close = None

    def __enter__(self):
        self.report = self.progress or None
        if self.progress is True:
            self.report, self.close = _bar()
        self.before = _core._report_to(self.report)
        return self

    def __exit__(self, *error):
        _core._report_to(self.before)
        if self.close:
            self.close()
