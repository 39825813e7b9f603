"""Program ``python -m mskgrasp.parts``."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Import the program and run it."""
    with ctrl_c_deferred():
        from mskgrasp.parts.commands.command_line import main as parts
    return parts()


if __name__ == "__main__":
    run("mskgrasp.parts", main)
