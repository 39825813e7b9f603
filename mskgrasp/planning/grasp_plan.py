"""Planned grasp: what was chosen, what is expected of it, and the candidates it was chosen from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from hal.hand import Load
from mskgrasp.core.displacement_covariance import displacement_jacobian
from mskgrasp.core.grasp import Grasp, PartView, to_object_displacement
from mskgrasp.parts import Part
from mskgrasp.perception.part_pose import PartPose

PlannedBy = Literal["networks", "uncertified", "certified", "another planner"]
"""What a planned grasp and its outcome come from: the networks' predictions; simulations made beforehand, by
which it is certified or not (`mskgrasp.planning.certified`); or a planner that is not ours
(`mskgrasp.planning.proposal`)."""


@dataclass(frozen=True)
class Shortlist:
    """Candidates by row (k,), best quality first, with their scores (k,), and mean and variance (k, m).

    m is 4, or 6 where the network predicts the swing, too.
    """

    rows: np.ndarray
    mean: np.ndarray
    variance: np.ndarray
    scores: np.ndarray

    def joined(self, other: Shortlist, found: np.ndarray) -> Shortlist:
        """Merge two shortlists, sorted by the qualities of all candidates."""
        names = ("rows", "mean", "variance", "scores")
        arrays = [np.append(getattr(self, name), getattr(other, name), axis=0) for name in names]
        order = np.argsort(-found[arrays[0]], kind="stable")
        return Shortlist(*(array[order] for array in arrays))


@dataclass(frozen=True, kw_only=True)
class GraspPlan:
    """Selected grasp, its predictions, and the candidates it was selected from.

    Attributes:
        grasp: The chosen one, base frame.
        quality: Predicted probability of success.
        grasp_displacement: (4,) expected grasp displacement, predicted by the network: the rigid motion, from
            which `displacement_of` gives that of a point.
        grasp_displacement_cov: (4, 4) its covariance; NaN if the network predicts none.
        swing: (2,) expected swing of the part in the hand, a rotation vector about x and y of the grasp
            frame, radians; NaN if the network predicts none.
        swing_var: (2,) its variances; NaN likewise.
        score: Variance score of the grasp, square metres; NaN if the network predicts no variance.
        view: The detected part.
        candidates: The n grasps considered, base frame.
        qualities: (n,) theirs.
        shortlist: (k,) indices of the candidates that it was selected from, best quality first.
        shortlist_scores: (k,) their variance scores, square metres.
        seconds: Time spent in each stage.
        pose: The part's pose as found with its CAD; None where it was planned from the image alone.
        planned_by: What the grasp and its outcome come from.
    """

    grasp: Grasp
    quality: float
    grasp_displacement: np.ndarray
    grasp_displacement_cov: np.ndarray
    swing: np.ndarray
    swing_var: np.ndarray
    score: float
    view: PartView
    candidates: Grasp
    qualities: np.ndarray
    shortlist: np.ndarray
    shortlist_scores: np.ndarray
    seconds: dict[str, float]
    pose: PartPose | None = None
    planned_by: PlannedBy = "networks"

    @classmethod
    def of(
        cls,
        view: PartView,
        candidates: Grasp,
        qualities: np.ndarray,
        best: Shortlist,
        chosen: int,
        *,
        seconds: dict[str, float],
    ) -> GraspPlan:
        """Make the plan of the shortlist's grasp ``chosen``, of n candidates."""
        row, mean, variance = best.rows[chosen], best.mean[chosen], best.variance[chosen]
        unknown = np.full(2, np.nan)
        return cls(
            grasp=candidates[row],
            quality=float(qualities[row]),
            grasp_displacement=mean[:4],
            grasp_displacement_cov=np.diag(variance[:4]),
            swing=mean[4:] if len(mean) > 4 else unknown,
            swing_var=variance[4:] if len(mean) > 4 else unknown,
            score=float(best.scores[chosen]),
            view=view,
            candidates=candidates,
            qualities=qualities,
            shortlist=best.rows,
            shortlist_scores=best.scores,
            seconds=seconds,
        )

    @property
    def certified(self) -> bool:
        """Whether the grasp is a certified one."""
        return self.planned_by == "certified"

    @property
    def summary(self) -> str:
        """Description of the grasp in one line, for the operator."""
        x, y, z, theta = self.grasp.as_vector()
        place = f"x {x:.3f}, y {y:.3f}, z {z:.3f} m, {np.degrees(theta):.0f} degrees"
        return f"grasp at {place}, quality {self.quality:.2f}"

    def displacement_of(self, point_base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute the expected displacement of a point of the part.

        Args:
            point_base: (3,) the point before the grasp, base frame, metres.

        Returns:
            Its displacement (4,), axes of the grasp frame, metres and radians, and the covariance (4, 4), to
            first order.
        """
        point_grasp = self.grasp.T_base_grasp.inverse().apply(np.asarray(point_base, dtype=np.float64))
        mean = self.grasp_displacement
        jacobian = displacement_jacobian(mean, point_grasp)
        return (
            to_object_displacement(mean, point_grasp),
            jacobian @ self.grasp_displacement_cov @ jacobian.T,
        )

    def load_of(self, part: Part) -> Load:
        """The part as the hand will hold it, for `hal.execute_grasp`, which tells the arm its weight.

        Its centre of mass is taken for the seen centre, and its inertia for that of a body which is alike in
        all directions: how the part is turned in the hand is not known.

        Args:
            part: The part on the table.
        """
        return Load(
            mass=part.mass,
            centre_tcp=np.asarray(self.grasp.T_base_tcp.inverse().apply(self.view.centre_base)),
            inertia=float(np.mean(part.principal_inertia)) * np.eye(3),
        )

    @property
    def displacement(self) -> np.ndarray:
        """(4,) expected displacement of the seen centre, axes of the grasp frame, metres and radians."""
        return self.displacement_of(self.view.centre_base)[0]

    @property
    def displacement_cov(self) -> np.ndarray:
        """(4, 4) its covariance."""
        return self.displacement_of(self.view.centre_base)[1]

    @property
    def displacement_std(self) -> np.ndarray:
        """(4,) its standard deviations."""
        return np.sqrt(np.diag(self.displacement_cov))

    def to_json(self) -> dict[str, Any]:
        """Convert the plan without its candidates to plain values; NaN becomes None."""
        return {
            "grasp": _plain(self.grasp.as_vector()),
            "quality": float(self.quality),
            "displacement": _plain(self.displacement),
            "displacement_std": _plain(self.displacement_std),
            "displacement_cov": _plain(self.displacement_cov),
            "grasp_displacement": _plain(self.grasp_displacement),
            "grasp_displacement_cov": _plain(self.grasp_displacement_cov),
            "swing": _plain(self.swing),
            "swing_var": _plain(self.swing_var),
            "score": _plain(np.asarray(self.score)),
            "part": {
                "centre_base": _plain(self.view.centre_base),
                "size": _plain(self.view.size),
                "gyration_radius": float(self.view.gyration_radius),
            },
            "planned_by": self.planned_by,
            "n_candidates": len(self.candidates),
            "n_shortlist": len(self.shortlist),
            "seconds": {stage: round(value, 4) for stage, value in self.seconds.items()},
        }


def _plain(values: np.ndarray) -> Any:
    if values.ndim:
        return [_plain(np.asarray(value)) for value in values]
    return float(values) if np.isfinite(values) else None
