"""``python -m mskgrasp.dataset``: check, describe and export datasets."""

from mskgrasp.cli import run
from mskgrasp.dataset.verbs import main

if __name__ == "__main__":
    run(main)
