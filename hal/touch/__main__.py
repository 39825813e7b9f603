"""``python -m hal.touch``."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Import the program and run it."""
    with ctrl_c_deferred():
        from hal.touch.run import main as touch
    return touch()


if __name__ == "__main__":
    run("hal.touch", main)
