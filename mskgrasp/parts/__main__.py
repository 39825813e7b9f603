"""``python -m mskgrasp.parts``: build, import, list and show parts."""

from mskgrasp.parts.commands.verbs import main
from mskgrasp.runtime.cli import run

if __name__ == "__main__":
    run(main)
