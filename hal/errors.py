"""Errors of arms, cameras and cells; each message names the remedy."""

from mskgrasp.core.errors import MskgraspError, UsageError


class HalError(MskgraspError):
    """Base of all faults of arms, cameras and cells."""


class NotConnected(HalError):
    """The device is used outside its context or was never connected."""


class DriverMissing(HalError):
    """The vendor's package is not installed; the message names the extra."""


class BadBackend(HalError):
    """An installed package's arm, camera or cell fails, breaks the contract, or shares its name."""


class IncompatibleDriver(HalError):
    """The installed driver speaks another version than the device."""


class CommunicationLost(HalError):
    """The device stopped answering."""


class CaptureFailed(HalError):
    """The camera delivered no frame, a stale one or a partial one."""


class NotCalibrated(HalError):
    """The camera's pose was measured by hand: no motion may depend on it."""


class OutOfWorkspace(HalError):
    """The commanded pose lies outside the workspace, the joint limits or the table clearance."""


class ArmInView(HalError):
    """The arm is not at home and may hide the table: nothing is planned on such a frame."""


class HandFull(HalError):
    """The hand holds something that would fall if the fingers opened."""


class LoadTooHeavy(HalError):
    """The part weighs more than the arm carries; nothing moved."""


class MotionAborted(HalError):
    """A motion ended before its goal: contact, reflex, or stop()."""


class Stopped(MotionAborted):
    """stop() was called: no program may resume the motion automatically."""


class NeedsRecovery(HalError):
    """An earlier error was not acknowledged; nothing moves until recover() is called."""


class BadRecording(HalError):
    """A recording is missing, damaged, or made by another version."""


class MissingRecording(BadRecording, UsageError):
    """There is no such recording."""


class NotRecorded(HalError):
    """A call on a replayed cell does not match the recording at this point."""
