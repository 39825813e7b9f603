"""``python -m hal.doctor``."""

from hal.doctor.run import main
from mskgrasp.runtime.cli import run

run(main)
