"""Program ``python -m mskgrasp.parts``."""

from mskgrasp.parts.commands.command_line import main
from mskgrasp.runtime.cli import run

if __name__ == "__main__":
    run(main)
