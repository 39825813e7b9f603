"""``python -m mskgrasp.palletize``."""

from mskgrasp.palletize.run import main
from mskgrasp.runtime.cli import run

run(main)
