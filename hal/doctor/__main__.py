"""``python -m hal.doctor``."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Import the program and run it."""
    with ctrl_c_deferred():
        from hal.doctor.run import main as doctor
    return doctor()


if __name__ == "__main__":
    run("hal.doctor", main)
