"""Selection of the certified grasps of a resting pose among those that were simulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mskgrasp.core.grasp import TILT_LIMIT
from mskgrasp.parts import Part
from mskgrasp.planning.certified import CertifiedGrasp, radius_about_vertical, without_selection_bias
from mskgrasp.simulation.certify import CertifyConfig, spread_out
from mskgrasp.simulation.pad_contact import Held, moment_share

SELECT_VERSION = 5
"""Raised by every change after which others of the simulated grasps are certified."""
PREFERRED_MOMENT = 0.5
"""Grasps up to this `moment_share` are preferred: the patch of real pads is not known well."""
LEAST_UNCERTIFIED = 0.8
"""Least share of its simulations that a grasp lifts which is kept where no grasp is certified."""


@dataclass(frozen=True, kw_only=True)
class Selected:
    """Grasps of a resting pose, least expected error first, their covariances as expected of chosen ones.

    Attributes:
        certified: The certified ones.
        uncertified: Where there is none, the best of those that fail by one criterion: by the share lifted,
            by the tilt, or by a spread of up to twice `CertifyConfig.most_error`. The networks would plan one
            of these candidates, without knowing which is best.
        reason: Why there is no certified one; empty: there is.
    """

    certified: tuple[CertifiedGrasp, ...] = ()
    uncertified: tuple[CertifiedGrasp, ...] = ()
    reason: str = ""


def select_certified(
    part: Part, resting: int, grasps: Sequence[CertifiedGrasp], config: CertifyConfig
) -> Selected:
    """Select the certified grasps of a resting pose."""
    if not grasps:
        return Selected(reason="the camera does not see it over the table")
    lifting = [one for one in grasps if one.lifted >= config.least_lifted * one.n and one.lifted >= 3]
    if not lifting:
        best = max((one.lifted / one.n for one in grasps), default=0.0)
        most = [one for one in _flat(grasps) if one.lifted >= max(best, LEAST_UNCERTIFIED) * one.n]
        return Selected(
            uncertified=_steady(*_errors(part, most, config), config.most_error, config),
            reason=f"no grasp lifts it in {config.least_lifted:.0%} of the simulations (best {best:.0%})",
        )
    flat = _flat(lifting)
    if not flat:
        # A tilt that is always the same moves no point from where it is expected in the hand.
        firm, _ = _errors(part, lifting, config)
        _, errors = _errors(part, [replace(one, swing=np.zeros(2)) for one in lifting], config)
        return Selected(
            uncertified=_steady(firm, errors, config.most_error, config),
            reason=f"it tilts by more than {np.degrees(TILT_LIMIT):g} degrees in every grasp that lifts it",
        )
    easy, errors = _errors(part, flat, config, most_moment=PREFERRED_MOMENT)
    steady = _steady(easy, errors, config.most_error, config)
    if steady:
        return Selected(certified=steady)
    firm, errors = _errors(part, flat, config)
    if not firm:
        return Selected(reason="its weight could turn it between the pads in every grasp that lifts it")
    steady = _steady(firm, errors, config.most_error, config)
    if not steady:
        most, least = 1e3 * config.most_error, 1e3 * min(errors)
        return Selected(
            uncertified=_steady(firm, errors, 2 * config.most_error, config),
            reason=f"every outcome spreads by more than {most:g} mm (least {least:.1f} mm)",
        )
    return Selected(certified=steady)


def _flat(grasps: Sequence[CertifiedGrasp]) -> list[CertifiedGrasp]:
    """The grasps in which the part hangs as it lay."""
    return [one for one in grasps if one.swing @ one.swing + np.trace(one.swing_cov) <= TILT_LIMIT**2]


def _errors(
    part: Part, grasps: Sequence[CertifiedGrasp], config: CertifyConfig, most_moment: float = 1.0
) -> tuple[list[CertifiedGrasp], list[float]]:
    """The grasps of one resting pose whose pads hold the part's weight, and their expected errors, metres."""
    firm = [one for one in grasps if _moment_share(part, one, config) <= most_moment]
    if not firm:
        return [], []
    radius = radius_about_vertical(part, firm[0].resting)
    errors = config.pose_errors
    pose_cov = np.diag(np.square([errors.position, errors.position, errors.turn]))
    firm = without_selection_bias(firm, radius)
    return firm, [float(np.sqrt(one.score(pose_cov, radius))) for one in firm]


def _moment_share(part: Part, one: CertifiedGrasp, config: CertifyConfig) -> float:
    held = Held(resting=one.resting, grasp=one.grasp, displacement=one.mean, swing=one.swing)
    return moment_share(part, held, config.least_friction)


def _steady(
    grasps: Sequence[CertifiedGrasp], errors: Sequence[float], most: float, config: CertifyConfig
) -> tuple[CertifiedGrasp, ...]:
    """The grasps whose errors are at most so large, metres, least first, apart and not too many."""
    order = np.argsort(errors, kind="stable")
    ranked = [grasps[row] for row in order if errors[row] <= most]
    return tuple(spread_out(ranked, config.kept))
