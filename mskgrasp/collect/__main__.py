"""``python -m mskgrasp.collect``."""

from mskgrasp.collect.run import main
from mskgrasp.runtime.cli import run

if __name__ == "__main__":
    run(main)
