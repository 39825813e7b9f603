"""``python -m hal.calibrate``."""

from hal.calibrate.run import main
from mskgrasp.runtime.cli import run

run(main)
