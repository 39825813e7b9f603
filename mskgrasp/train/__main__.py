"""``python -m mskgrasp.train``."""

from mskgrasp.runtime.cli import run
from mskgrasp.train.run import main

run(main)
