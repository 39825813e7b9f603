"""``python -m mskgrasp.evaluate``."""

from mskgrasp.evaluate.run import main
from mskgrasp.runtime.cli import run

run(main)
