"""``python -m hal.home``."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Import the program and run it."""
    with ctrl_c_deferred():
        from hal.home.run import main as home
    return home()


if __name__ == "__main__":
    run("hal.home", main)
