"""``python -m hal.calibrate``."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Import the program and run it."""
    with ctrl_c_deferred():
        from hal.calibrate.run import main as calibrate
    return calibrate()


if __name__ == "__main__":
    run("hal.calibrate", main)
