"""``python -m mskgrasp.plan``."""

from mskgrasp.plan.run import main
from mskgrasp.runtime.cli import run

run(main)
