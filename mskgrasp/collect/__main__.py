"""``python -m mskgrasp.collect``."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Imports the program and runs it."""
    with ctrl_c_deferred():
        from mskgrasp.collect.run import main as collect
    return collect()


if __name__ == "__main__":
    run("mskgrasp.collect", main)
