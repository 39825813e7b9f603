"""``python -m mskgrasp.dataset``: check, describe and export datasets."""

from mskgrasp.dataset.commands.verbs import main
from mskgrasp.runtime.cli import run

if __name__ == "__main__":
    run(main)
