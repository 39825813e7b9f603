"""``python -m hal.record``."""

from hal.record.run import main
from mskgrasp.runtime.cli import run

run(main)
