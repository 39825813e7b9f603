"""Report of an assessed part."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mskgrasp.assess.config import Tolerance
from mskgrasp.assess.figures import MOST_POSES, draw_grasps, draw_shares, drawn_poses
from mskgrasp.assess.scene import scene_page
from mskgrasp.assess.summary import DISTANCES, Row, summarise, summary_json, verdict
from mskgrasp.assess.trials import EXACT, NOISY
from mskgrasp.core.files import write_whole
from mskgrasp.core.grasp import MAX_OPENING, TILT_LIMIT
from mskgrasp.core.metrics import wilson_interval
from mskgrasp.core.share import Share
from mskgrasp.parts import Part
from mskgrasp.parts.least_width import least_widths
from mskgrasp.perception.part_pose.known_part import KnownPart, Lying
from mskgrasp.planning.certified import CertifiedGrasps, radius_about_vertical
from mskgrasp.planning.isaac_grasp import write_isaac_grasp
from mskgrasp.reports.html import write_html
from mskgrasp.reports.quantities import counted
from mskgrasp.reports.section import Figure, Section, View, settings_section
from mskgrasp.runtime.console_table import Table
from mskgrasp.trials.placed_trial import CORRECTIONS, TOO_HEAVY, PlacedTrial

_HEADINGS = {
    "none": "placed directly",
    "predicted": "corrected by the prediction",
    "seen": "part seen in hand",
}
_ONLY_LOOKS = (
    "Where the part only looks the same, the camera cannot tell these turns apart: the trials count a part "
    "that is placed in another of them as turned."
)
_RULES = (
    "Rules of the verdict: of all attempts, failed ones included, at least 95 % must end within the "
    "tolerance. Place directly, if they do without any correction; correct by the prediction, if they do "
    "when the predicted displacement is taken into account; look at the part in the hand, if they do when "
    "its pose there is measured exactly; otherwise use a fixture or another pose.",
    "Corrected by the prediction is what was simulated and measured. The other two columns follow from it: "
    "without a correction the part is off by its predicted displacement as well, with an exact look at the "
    "part in the hand only by what the release adds.",
)


def write_report(
    out: Path,
    part: Part,
    certified: CertifiedGrasps,
    trials: Sequence[PlacedTrial],
    tolerance: Tolerance,
    settings: dict[str, Any],
) -> tuple[str, list[Row]]:
    """Write report.html, report.json, grasps.json, grasps.isaac.yaml and the figures.

    Args:
        out: Folder of the report.
        part: The part.
        certified: Its certified grasps.
        trials: All trials.
        tolerance: Of the verdict.
        settings: Of the program.

    Returns:
        The verdict in a line, and the summary of the trials.
    """
    rows = summarise(trials, tolerance, TILT_LIMIT)
    verdicts = {name: verdict(rows, name, tolerance) for name in (EXACT, NOISY)}
    headline = conclusion(part, certified, trials, verdicts)
    poses = drawn_poses(part, certified)
    certified.write(out)
    write_isaac_grasp(out / "grasps.isaac.yaml", part, certified)
    draw_shares(trials, rows, tolerance.distance, out / "shares.png")
    draw_grasps(part, certified, out / "grasps.png")
    values = summary_json(
        rows, dict(name=part.name, hash=part.content_hash, source=part.source), verdicts, tolerance
    )
    values["headline"] = headline
    write_whole(out / "report.json", (json.dumps(values, indent=1, allow_nan=False) + "\n").encode())
    sections = [
        trials_section(rows, tolerance, out / "shares.png"),
        _distances_section(rows),
        poses_section(part, certified, out / "grasps.png"),
        Section(
            title="Certified grasps in 3-D",
            views=[
                View(
                    page=scene_page(part, certified, poses),
                    caption=f"Pose {', '.join(map(str, poses))} in the order of the figure above, each with "
                    "its best certified grasp, if it has one; translucent: where the part is expected once "
                    "the fingers have closed. Drag to turn, scroll to zoom.",
                )
            ],
            page_only=True,
        ),
        _grasps_section(certified),
        settings_section(settings),
    ]
    write_html(out / "report.html", title=f"Precision of {part.name}", conclusion=headline, sections=sections)
    return headline, rows


def conclusion(
    part: Part, certified: CertifiedGrasps, trials: Sequence[PlacedTrial], verdicts: dict[str, str]
) -> str:
    """The result in a line or two: that no attempt lifted the part, and why, or the verdicts."""
    if not any(trial.lifted for trial in trials):
        reasons = counted(Counter(trial.reason for trial in trials if trial.reason))
        likeliest = drawn_poses(part, certified)[0]
        why = certified.without.get(likeliest, "")
        # All planners and conditions share the scenes, and without certified grasps the plans.
        scenes = len({trial.number for trial in trials})
        most = wilson_interval(0, scenes)[1]
        width = least_widths(part).min()
        lead = f"{part.name} was not grasped: none"
        if width == np.inf:
            lead = f"{part.name} has no two opposite faces that fingers could hold, in any resting pose. None"
        elif width > MAX_OPENING:
            lead = (
                f"{part.name} is wider than the hand in every resting pose: where fingers could hold it, "
                f"its faces are {1e3 * width:.0f} mm apart or more, and the hand opens "
                f"{1e3 * MAX_OPENING:.0f} mm. None"
            )
        if all((trial.reason or "").startswith(TOO_HEAVY) for trial in trials):
            return f"{lead} of {len(trials)} attempts could be made ({reasons})."
        return (
            f"{lead} of {len(trials)} attempts lifted it ({reasons}{'; ' + why if why else ''}); "
            f"95 % interval of the share lifted, by {scenes} scene{'' if scenes == 1 else 's'}: 0 to "
            f"{most:.0%}."
        )
    lines = [f"With {'an ' if name == EXACT else ''}{name}: {text}." for name, text in verdicts.items()]
    return " ".join(lines)


def trials_section(rows: Sequence[Row], tolerance: Tolerance, figure: Path) -> Section:
    """Shares lifted and within the tolerance, by condition and planner."""
    table = [
        (
            row.condition,
            row.planned_by,
            _share(row.lifted),
            *(_share(row.within[one]) for one in CORRECTIONS),
            "-" if row.translation_rmse is None else f"{1e3 * row.translation_rmse:.2f} mm",
            "-" if row.rotation_rmse is None else f"{np.degrees(row.rotation_rmse):.2f} deg",
            row.tilted,
            counted(row.reasons) or "-",
        )
        for row in rows
    ]
    header = (
        "condition", "planned by", "lifted", *(_HEADINGS[one] for one in CORRECTIONS), "RMSE", "turn RMSE",
        "tilted", "not placed",
    )  # fmt: skip
    return Section(
        title=f"Trials: within {tolerance}",
        text=_RULES,
        tables=[
            Table(
                header=header,
                rows=table,
                caption="Shares of all attempts with 95 % intervals (Wilson); RMSE of the predicted "
                "displacement in the hand; tilted: in the hand, by more than "
                f"{np.degrees(TILT_LIMIT):g} degrees",
            )
        ],
        figures=[
            Figure(
                path=figure,
                caption="Share of attempts that end within a distance of the target, whatever the turn",
            )
        ],
    )


def _distances_section(rows: Sequence[Row]) -> Section:
    table = [
        (
            row.condition,
            row.planned_by,
            _HEADINGS[one],
            *(f"{share.value:.0%}" for share in row.within_distance[one]),
        )
        for row in rows
        for one in CORRECTIONS
    ]
    header = ("condition", "planned by", "placed", *(f"{1e3 * distance:g} mm" for distance in DISTANCES))
    return Section(
        title="Placed within a distance",
        tables=[Table(header=header, rows=table, caption="Shares of all attempts, whatever the turn")],
        page_only=True,
    )


def poses_section(part: Part, certified: CertifiedGrasps, figure: Path) -> Section:
    """Resting poses with their certified grasps."""
    conditions = certified.conditions
    errors, noise, physics = (conditions[name] for name in ("pose_errors", "noise", "physics"))
    friction, force = (
        "{:g} to {:g}".format(*(noise[name] or 2 * [physics[name]]))
        for name in ("friction_pad_part", "finger_force")
    )
    pose_cov = np.diag(np.square([errors["position"], errors["position"], errors["turn"]]))
    looks = {pose.resting: pose for look in KnownPart.of(part).looks for pose in look.poses}
    rows = []
    simulated = "; planned with the best that was simulated"
    for number, share in enumerate(part.resting_probability):
        if number in certified.like:
            continue
        alike = [other for other, (first, _) in certified.like.items() if first == number]
        grasps, _ = certified.of(number)
        radius = radius_about_vertical(part, number)
        why_not = certified.without.get(number, "")
        best = min((1e3 * np.sqrt(one.score(pose_cov, radius)) for one in grasps), default=None)
        rows.append(
            (
                f"{number}" + (f" and {len(alike)} alike" if alike else ""),
                f"{share + part.resting_probability[alike].sum():.1%}",
                _turns(looks[number]),
                len(grasps),
                "-" if best is None else f"{best:.2f} mm",
                why_not + simulated if certified.uncertified_of(number)[0] else why_not,
            )
        )
    rows.sort(key=lambda row: -float(row[1].rstrip("%")))
    drawn = f", in the {MOST_POSES} most probable poses" if len(rows) > MOST_POSES else ""
    return Section(
        title="Resting poses",
        text=[
            f"Certified: lifted in at least {conditions['least_lifted']:.0%} of the last simulations, tilts "
            f"by at most {np.degrees(TILT_LIMIT):g} degrees (RMS), expected error at most "
            f"{1e3 * conditions['most_error']:g} mm. The expected error is the root of the mean squared "
            "distance by which the part's points miss their predicted places, with errors of the seen pose "
            f"of {1e3 * errors['position']:g} mm and {np.degrees(errors['turn']):.2g} degrees, friction "
            f"{friction}, force {force} N a pad, and the arm's {1e3 * noise['arm_position_std']:g} mm. The "
            f"pads stay {1e3 * conditions['clearance']:g} mm over the table (--clearance). The smallest of "
            "several estimates is somewhat too small; the trials above are other simulations.",
            *([_ONLY_LOOKS] if not all(one.symmetric for one in looks.values()) else []),
        ],
        tables=[
            Table(
                header=(
                    "pose",
                    "probability",
                    "looks the same turned by",
                    "certified grasps",
                    "least expected error",
                    "why not",
                ),
                rows=rows,
            )
        ],
        figures=[Figure(path=figure, caption=f"Certified grasps from above, the best one in blue{drawn}")],
    )


def _turns(lying: Lying) -> str:
    """Turns at which a part that lies so looks the same from above."""
    if lying.order == 1:
        return "-"
    turns = f"{360 / lying.order:.3g} degrees" if lying.order else "any angle"
    return turns if lying.symmetric else f"{turns}, but is not the same"


def _grasps_section(certified: CertifiedGrasps) -> Section:
    rows = []
    for number, grasp in enumerate((*certified.grasps, *certified.uncertified)):
        x, y, z, theta = grasp.grasp
        low, high = grasp.lifted_interval
        std = np.sqrt(np.diag(grasp.residual))
        rows.append(
            (
                grasp.resting,
                "yes" if number < len(certified.grasps) else "no",
                f"{1e3 * x:.1f}, {1e3 * y:.1f}, {1e3 * z:.1f}",
                f"{np.degrees(theta):.1f}",
                f"{grasp.lifted} of {grasp.n} [{low:.0%}, {high:.0%}]",
                ", ".join(f"{1e3 * value:+z.2f}" for value in grasp.mean[:3]),
                f"{np.degrees(grasp.mean[3]):+z.2f}",
                ", ".join(f"{1e3 * value:.2f}" for value in std[:3]),
                f"{np.degrees(std[3]):.2f}",
                f"{np.degrees(np.linalg.norm(grasp.swing)):.1f}",
            )
        )
    header = (
        "pose", "certified", "x, y, z, mm", "theta, deg", "lifted", "shift x, y, z, mm", "turn, deg",
        "deviations, mm", "deg", "tilt, deg",
    )  # fmt: skip
    return Section(
        title="All grasps",
        text=[
            "In the part's rest frame: under its centroid, z up, axes of the mesh file turned into the "
            "resting pose. Shift and turn of the part in the hand, and their standard deviations apart from "
            "errors of the seen pose, along the axes of the grasp. Grasps that are not certified are the "
            "best of their pose, which has no certified one."
        ],
        tables=[Table(header=header, rows=rows)],
        page_only=True,
    )


def _share(share: Share) -> str:
    low, high = share.interval
    return f"{share.n} of {share.of} [{low:.0%}, {high:.0%}]"
