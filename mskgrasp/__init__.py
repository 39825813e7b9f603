"""Grasps of industrial parts that are robust, precise, and know how the part will shift."""

import signal
import sys

__version__ = "0.1.0"

if sys.argv[:1] == ["-m"] and sys.orig_argv[-len(sys.argv)].startswith(("mskgrasp.", "hal.")):
    # A program is being started, and Ctrl-C waits for `mskgrasp.runtime.cli.run`: a library whose import it
    # would interrupt may swallow it, and go on without what it was importing.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
