"""Record of one placement."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

from mskgrasp.core.json_text import Four, checked

Correction = Literal["none", "predicted", "truth"]
CORRECTIONS: tuple[Correction, Correction, Correction] = ("none", "predicted", "truth")


def placement_name(key: tuple[str, int, int, Correction]) -> str:
    """Name of a placement's files, by `Placement.key`."""
    part, number, slot, correction = key
    return f"{part}-{number:03d}-{slot:02d}-{correction}"


@dataclass(frozen=True, kw_only=True)
class Placement:
    """Outcome of placing one part once; metres and radians.

    Attributes:
        part: Name of the part.
        number: Index of the trial of the part, or of the pallet.
        slot: Index of the slot.
        correction: Displacement that was corrected for.
        target: x, y of the part's centre and direction of its longer side, base frame.
        placed: The part was released at the target.
        reason: Reason why it was not; empty where it was.
        grasp: (4,) the executed grasp; None, as all that follows, where no grasp was found.
        predicted: (4,) expected displacement of the part's detected centre in the hand.
        measured: (4,) its true displacement; None where nothing tracks the part.
        translation_error: Distance of the placed part's centre from its target; None where not placed or not
            measured.
        rotation_error: Absolute error of its turn; None as before.
        unmeasured: Reason why a placed part was not measured; empty where it was.
        refusal: Why all grasps were refused, in a line; empty where one was tried.
    """

    part: str
    number: int
    slot: int
    correction: Correction
    target: tuple[float, float, float]
    placed: bool
    reason: str
    grasp: Four | None = None
    predicted: Four | None = None
    measured: Four | None = None
    translation_error: float | None = None
    rotation_error: float | None = None
    unmeasured: str = ""
    refusal: str = ""

    @property
    def key(self) -> tuple[str, int, int, Correction]:
        """Identifier of the placement in its run."""
        return self.part, self.number, self.slot, self.correction

    @property
    def name(self) -> str:
        """Name of the placement's files."""
        return placement_name(self.key)

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Placement:
        """The placement that `to_json` converted.

        Raises:
            TypeError, ValueError, KeyError: The values are not a placement.
        """
        x, y, theta = values["target"]
        rest: dict[str, Any] = {name: value for name, value in values.items() if name != "target"}
        return checked(cls(target=(x, y, theta), **rest))
