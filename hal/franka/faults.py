"""Translation of the vendors' exceptions into errors of `hal`, each in one line.

libfranka's texts are matched, because panda_py raises plain ``RuntimeError`` for most faults and franky
for some; the texts are those of libfranka 0.9.2 and 0.21.2, and the tests provoke each with the real wheel.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from hal import errors
from hal.franka.driver import DriverName

EXTRA = "EXTRAS=dev,franka .ci/setup"
_WHEELS: dict[DriverName, str] = {"franky": "franky-control", "panda_py": "panda-python"}
_REFUSED = "connection to fci refused"
_NO_ROBOT = (_REFUSED, "host not found", "connection error", "network is unreachable")
_LOST = ("timeout", "connection", "socket", "network", "broken pipe", "reset by peer")
_WRONG_MODE = "command not possible in the current mode"
_NO_TRAJECTORY = "motion planner failed"


class NoTrajectory(errors.MotionAborted):
    """The driver's solver found no trajectory; the robot reports no fault."""


ERRORS: dict[str, type[errors.HalError]] = {
    kind.__name__: kind
    for kind in (
        errors.CommunicationLost,
        errors.DriverMissing,
        errors.IncompatibleDriver,
        errors.MotionAborted,
        errors.NeedsRecovery,
        errors.NotConnected,
        NoTrajectory,
    )
}
"""Errors that a driver's process may raise, by name."""


@contextmanager
def opening_hand(host: str) -> Iterator[None]:
    """Context in which a driver connects to the hand of a robot that has answered.

    The hand is a server of its own, which libfranka reports as missing in the words for a missing robot.

    Raises:
        NotConnected: There is no hand.
    """
    try:
        yield
    except Exception as error:
        if _REFUSED not in str(error).lower():
            raise
        raise errors.NotConnected(
            f"the robot at {host} answers, its hand does not: choose and initialise the Franka Hand in Desk, "
            "Settings, End Effector; check its cable"
        ) from error


def explain(error: BaseException, driver: DriverName, host: str) -> errors.HalError:
    """Error of `hal` for a driver's exception: one line with the remedy."""
    if isinstance(error, errors.HalError):
        return error
    text = " ".join(str(error).removeprefix("libfranka:").split())
    low = text.lower()
    name = type(error).__name__
    if isinstance(error, ImportError):
        return errors.DriverMissing(
            f"driver {driver} needs the package {_WHEELS[driver]} ({text}); run: {EXTRA}"
        )
    if name.startswith("IncompatibleVersion"):
        return errors.IncompatibleDriver(
            f"{host}: {text.rstrip('.')}; the installed {_WHEELS[driver]} is for another robot or system "
            "version: docs/real_cell.md says which driver package fits"
        )
    if any(part in low for part in _NO_ROBOT):
        return errors.NotConnected(
            f"no robot at {host} ({text.rstrip('.')}); check 'host', the cable, "
            "and that FCI is active in Desk"
        )
    if name in ("NetworkException", "ProtocolException") or any(part in low for part in _LOST):
        return errors.CommunicationLost(
            f"the link to {host} is lost ({text.rstrip('.')}); the robot has stopped: check cable and Desk, "
            "then open the cell again"
        )
    if _WRONG_MODE in low:
        return errors.MotionAborted(
            f"{text.rstrip('.')}; unlock the joints and release the user stop (after a reflex check the arm, "
            "then press and release it), then start again, or call recover() where the arm is connected"
        )
    kind = NoTrajectory if _NO_TRAJECTORY in low else errors.MotionAborted
    return kind(f"{text.rstrip('.') or name}; check the arm, then call recover()")
