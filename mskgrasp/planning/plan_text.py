"""A plan in words."""

from __future__ import annotations

import numpy as np

from mskgrasp.perception.part_pose import PartPose
from mskgrasp.planning.config import MIN_QUALITY
from mskgrasp.planning.grasp_plan import GraspPlan


def plan_text(plan: GraspPlan) -> str:
    """The plan in words, with units."""
    x, y, z, theta = plan.grasp.as_vector()
    mean, std = plan.displacement, plan.displacement_std
    shifts = ", ".join(
        f"{name} {value * 1e3:+z.1f}{_spread(deviation * 1e3)} mm"
        for name, value, deviation in zip(("dx", "dy", "dz"), mean[:3], std[:3], strict=True)
    )
    turn = f"dtheta {np.degrees(mean[3]):+z.1f}{_spread(np.degrees(std[3]))} deg"
    tilt = float(np.degrees(np.linalg.norm(plan.swing)))
    tilted = f"{tilt:.1f}{_spread(np.degrees(np.sqrt(plan.swing_var.sum())))} deg"
    stages = ", ".join(f"{name} {value:.2f} s" for name, value in plan.seconds.items() if name != "total")
    pose = [] if plan.pose is None else [_pose_text(plan.pose)]
    n, best = len(plan.candidates), float(np.max(plan.qualities, initial=0.0))
    of = {
        "networks": f"best of {n}: {plan.qualities.max():.3f}",
        "uncertified": f"{n} simulated grasps, none certified",
        "certified": f"{n} certified grasp{'' if n == 1 else 's'}",
        "another planner": "as the planner states it",
    }[plan.planned_by]
    return "\n".join(
        [
            *pose,
            f"grasp         x {x:.4f} m, y {y:.4f} m, z {z:.4f} m, theta {np.degrees(theta):.1f} deg (base)",
            f"quality       {'none stated' if np.isnan(plan.quality) else f'{plan.quality:.3f} ({of})'}",
            *([] if np.isnan(plan.quality) else [f"verdict       {verdict(plan.quality, best)}"]),
            f"displacement  {shifts}, {turn} (seen centre, grasp frame)",
            *([] if np.isnan(plan.swing).any() else [f"tilt          {tilted}"]),
            *([] if np.isnan(plan.score) else [f"precision     {precision(plan.score)}"]),
            f"planned in    {plan.seconds['total']:.2f} s ({stages})",
        ]
    )


def verdict(quality: float, best: float = 0.0) -> str:
    """Whether a grasp of this predicted quality is worth trying, in words; ``best``: of all candidates."""
    if quality >= MIN_QUALITY:
        return f"worth trying: the part is lifted with a predicted probability of {quality:.0%}"
    remedy = (
        f"others reach {best:.0%}, which --planner.min-quality {MIN_QUALITY:g} takes"
        if best >= MIN_QUALITY
        else "place it another way"
    )
    return (
        f"not worth trying: the part is lifted with a predicted probability of {quality:.0%}, under "
        f"{MIN_QUALITY:.0%}; {remedy}"
    )


def precision(score: float) -> str:
    """A plan's variance score, m^2, in words."""
    return (
        f"the part's points are expected {1e3 * np.sqrt(score):.1f} mm (RMS) from their predicted places, a "
        "tilt included; +- is one standard deviation"
    )


def _pose_text(pose: PartPose) -> str:
    x, y, _ = pose.T_base_obj.position
    std = np.sqrt(np.diag(pose.covariance))
    return (
        f"part          resting pose {pose.resting} at x {x:.4f} +- {std[0]:.4f} m, "
        f"y {y:.4f} +- {std[1]:.4f} m, its turn known to +- {np.degrees(std[2]):.1f} deg"
    )


def _spread(deviation: float) -> str:
    """A standard deviation after its mean; nothing where none is predicted."""
    return "" if np.isnan(deviation) else f" +- {deviation:.1f}"
