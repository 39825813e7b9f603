"""Grasps of industrial parts that are robust, precise, and know how the part will shift."""

import sys

__version__ = "0.1.0"

if sys.argv[:1] == ["-m"]:
    # A program is being started: Ctrl-C while its imports run is as little a defect as later.
    def _quiet_interrupt(kind, error, trace, report=sys.excepthook) -> None:  # noqa: ANN001
        if issubclass(kind, KeyboardInterrupt):
            print("stopped by Ctrl-C before anything was done", file=sys.stderr)
        else:
            report(kind, error, trace)

    sys.excepthook = _quiet_interrupt
