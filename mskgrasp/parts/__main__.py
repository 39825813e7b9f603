"""``python -m mskgrasp.parts``: build, import, list and show parts."""

from mskgrasp.cli import run
from mskgrasp.parts.verbs import main

if __name__ == "__main__":
    run(main)
