"""Selection of the certified grasps of a resting pose among those that were simulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mskgrasp.core.grasp import TILT_LIMIT
from mskgrasp.parts import Part
from mskgrasp.planning.certified import CertifiedGrasp, radius_about_vertical, without_selection_bias
from mskgrasp.simulation.certify import CertifyConfig, spread_out

SELECT_VERSION = 2
"""Raised by every change after which others of the simulated grasps are certified."""
GRAVITY = 9.81
"""m/s^2"""


def moment_share(part: Part, one: CertifiedGrasp, config: CertifyConfig) -> float:
    """Moment of a held part's weight about the closing direction, as a share of what the pads hold.

    PhysX holds a flat contact by its two farthest points, nearly twice as well as even pressure does, and so
    lifts parts far from their centre of mass that would turn. Here each pad holds by friction over a soft
    patch of `Physics.pad_patch_radius`, the weight and its moment together as far as the ellipsoid of the
    limit surface goes (Howe and Cutkosky, Practical force-motion models for sliding manipulation, 1996), with
    as little friction and force as all but `CertifyConfig.least_lifted` of the simulations had.

    Args:
        part: The part, whose origin is its centre of mass.
        one: Its grasp.
        config: Settings of the certification.
    """
    x, y, _, theta = one.grasp
    beside = -(np.cos(theta) * x + np.sin(theta) * y) + one.mean[0]  # along the pads
    weight = part.mass * GRAVITY
    friction, force = (
        np.linspace(*(varied or (fixed, fixed)), 101)
        for varied, fixed in (
            (config.noise.friction_pad_part, config.physics.friction_pad_part),
            (config.noise.finger_force, config.physics.finger_force),
        )
    )
    least = float(np.quantile(np.outer(friction, force), 1 - config.least_lifted))
    left = 1 - (weight / (2 * least)) ** 2
    most = 2 * least * config.physics.pad_patch_radius * np.sqrt(max(left, 0.0))
    return float(weight * abs(beside) / most) if most > 0 else np.inf


@dataclass(frozen=True, kw_only=True)
class Selected:
    """Grasps of a resting pose, least expected error first, their covariances as expected of chosen ones.

    Attributes:
        certified: The certified ones.
        tilting: Where there is none, those that fail by the tilt alone.
        reason: Why there is no certified one; empty: there is.
    """

    certified: tuple[CertifiedGrasp, ...] = ()
    tilting: tuple[CertifiedGrasp, ...] = ()
    reason: str = ""


def select_certified(
    part: Part, resting: int, grasps: Sequence[CertifiedGrasp], config: CertifyConfig
) -> Selected:
    """Select the certified grasps of a resting pose."""
    errors = config.pose_errors
    pose_cov = np.diag(np.square([errors.position, errors.position, errors.turn]))
    radius = radius_about_vertical(part, resting)
    if not grasps:
        return Selected(reason="the camera does not see it over the table")
    lifting = [one for one in grasps if one.lifted >= config.least_lifted * one.n and one.lifted >= 3]
    if not lifting:
        best = max((one.lifted / one.n for one in grasps), default=0.0)
        reason = f"no grasp lifts it in {config.least_lifted:.0%} of the simulations (best {best:.0%})"
        return Selected(reason=reason)
    flat = [one for one in lifting if one.swing @ one.swing + np.trace(one.swing_cov) <= TILT_LIMIT**2]
    if not flat:
        firm = without_selection_bias(_firm(part, lifting, config), radius)
        # A tilt that is always the same moves no point from where it is expected in the hand.
        errors = [float(np.sqrt(replace(one, swing=np.zeros(2)).score(pose_cov, radius))) for one in firm]
        tilt = np.degrees(TILT_LIMIT)
        return Selected(
            tilting=_steady(firm, errors, config),
            reason=f"it tilts by more than {tilt:g} degrees in every grasp that lifts it",
        )
    firm = without_selection_bias(_firm(part, flat, config), radius)
    if not firm:
        return Selected(reason="its weight could turn it between the pads in every grasp that lifts it")
    errors = [float(np.sqrt(one.score(pose_cov, radius))) for one in firm]
    steady = _steady(firm, errors, config)
    if not steady:
        most, least = 1e3 * config.most_error, 1e3 * min(errors)
        return Selected(reason=f"every outcome spreads by more than {most:g} mm (least {least:.1f} mm)")
    return Selected(certified=steady)


def _firm(part: Part, grasps: Sequence[CertifiedGrasp], config: CertifyConfig) -> list[CertifiedGrasp]:
    """The grasps whose pads hold the part's weight."""
    return [one for one in grasps if moment_share(part, one, config) <= 1]


def _steady(
    grasps: Sequence[CertifiedGrasp], errors: Sequence[float], config: CertifyConfig
) -> tuple[CertifiedGrasp, ...]:
    """The grasps of little enough expected error (m), least first, apart from each other and not too many."""
    order = np.argsort(errors, kind="stable")
    ranked = [grasps[row] for row in order if errors[row] <= config.most_error]
    return tuple(spread_out(ranked, config.kept))
