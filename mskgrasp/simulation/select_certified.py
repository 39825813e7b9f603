"""Selection of the certified grasps of a resting pose among those that were simulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mskgrasp.core.grasp import TILT_LIMIT
from mskgrasp.parts import Part
from mskgrasp.planning.certified import CertifiedGrasp, radius_about_vertical, without_selection_bias
from mskgrasp.simulation.certify import CertifyConfig, spread_out
from mskgrasp.simulation.pad_contact import HeldPart, moment_share

SELECT_VERSION = 9
"""Raised by every change after which others of the simulated grasps are certified."""
PREFERRED_MOMENT = 0.5
"""Grasps up to this `moment_share` are preferred: half of it is left for pads that press unevenly."""
LEAST_UNCERTIFIED = 0.8
"""Least share of its simulations that a grasp lifts which is kept where no grasp is certified."""


@dataclass(frozen=True, kw_only=True)
class Selected:
    """Grasps of a resting pose, least expected error first, their covariances as expected of chosen ones.

    Attributes:
        certified: The certified ones.
        uncertified: Where there is none, the best of those that fail by one criterion: by the share lifted,
            by the tilt, by a moment of the weight of up to twice what the pads hold, or by a spread of up to
            twice `CertifyConfig.most_error`. The networks would plan one of these candidates, without knowing
            which is best.
        reason: Why there is no certified one; empty: there is.
    """

    certified: tuple[CertifiedGrasp, ...] = ()
    uncertified: tuple[CertifiedGrasp, ...] = ()
    reason: str = ""


def select_certified(part: Part, grasps: Sequence[CertifiedGrasp], config: CertifyConfig) -> Selected:
    """Select the certified ones of the grasps of a resting pose."""
    if not grasps:
        return Selected(reason="the camera does not see it over the table")
    lifting = [one for one in grasps if one.lifted >= config.least_lifted * one.n and one.lifted >= 3]
    if not lifting:
        best = max((one.lifted / one.n for one in grasps), default=0.0)
        most = [one for one in _flat(grasps) if one.lifted >= max(best, LEAST_UNCERTIFIED) * one.n]
        return Selected(
            uncertified=_steady(*_errors(part, _firm(part, most, config), config), config.most_error, config),
            reason=f"no grasp lifts it in {config.least_lifted:.0%} of the simulations (best {best:.0%})",
        )
    flat = _flat(lifting)
    if not flat:
        # A tilt that is always the same moves no point from where it is expected in the hand.
        firm = _firm(part, lifting, config)
        _, errors = _errors(part, [replace(one, swing=np.zeros(2)) for one in firm], config)
        return Selected(
            uncertified=_steady(_errors(part, firm, config)[0], errors, config.most_error, config),
            reason=f"it tilts by more than {np.degrees(TILT_LIMIT):g} degrees in every grasp that lifts it",
        )
    easy = _firm(part, flat, config, most_moment=PREFERRED_MOMENT)
    steady = _steady(*_errors(part, easy, config), config.most_error, config)
    if steady:
        return Selected(certified=steady)
    firm, errors = _errors(part, _firm(part, flat, config), config)
    if not firm:
        nearly = _firm(part, flat, config, most_moment=2.0)
        return Selected(
            uncertified=_steady(*_errors(part, nearly, config), config.most_error, config),
            reason="its weight could turn it between the pads in every grasp that lifts it",
        )
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


def _firm(
    part: Part, grasps: Sequence[CertifiedGrasp], config: CertifyConfig, most_moment: float = 1.0
) -> list[CertifiedGrasp]:
    """The grasps whose pads hold the part's weight."""
    found = []
    for one in grasps:
        held = HeldPart(
            part=part, resting=one.resting, grasp=one.grasp, displacement=one.mean, swing=one.swing
        )
        if moment_share(held, config.least_friction_force) <= most_moment:
            found.append(one)
    return found


def _errors(
    part: Part, grasps: Sequence[CertifiedGrasp], config: CertifyConfig
) -> tuple[list[CertifiedGrasp], list[float]]:
    """Grasps of one resting pose without the bias of their choice, and their expected errors, metres."""
    if not grasps:
        return [], []
    radius = radius_about_vertical(part, grasps[0].resting)
    errors = config.pose_errors
    pose_cov = np.diag(np.square([errors.position, errors.position, errors.turn]))
    found = without_selection_bias(list(grasps), radius)
    return found, [float(np.sqrt(one.score(pose_cov, radius))) for one in found]


def _steady(
    grasps: Sequence[CertifiedGrasp], errors: Sequence[float], most: float, config: CertifyConfig
) -> tuple[CertifiedGrasp, ...]:
    """The grasps whose errors are at most so large, metres, least first, apart and not too many."""
    order = np.argsort(errors, kind="stable")
    ranked = [grasps[row] for row in order if errors[row] <= most]
    return tuple(spread_out(ranked, config.kept))
