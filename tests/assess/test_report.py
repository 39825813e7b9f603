"""Report of an assessment: figures, exports, and a page that works without a network."""

from __future__ import annotations

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh

from mskgrasp.assess.config import parse_tolerance
from mskgrasp.assess.report import conclusion, poses_section, write_report
from mskgrasp.assess.trials import EXACT, NOISY
from mskgrasp.parts.importing.import_file import import_part
from mskgrasp.parts.least_width import least_widths
from tests.assess.made_trials import failed, made
from tests.browser import Page
from tests.planning.test_certified import PART, certified, certified_grasp

CONDITIONS = dict(
    seed=0,
    least_lifted=0.95,
    most_error=0.002,
    pose_errors=dict(position=3e-4, height=2e-4, turn=5e-3),
    clearance=1e-3,
    noise=dict(arm_position_std=2e-4, friction_pad_part=[0.2, 0.6], finger_force=None),
    physics=dict(finger_force=40.0),
)


def grasps():
    return certified(
        certified_grasp(), certified_grasp(resting=2), without={4: "it is rare (probability 1.0%)"},
        like={1: (0, 0.5), 3: (2, 0.0)}, conditions=CONDITIONS,
    )  # fmt: skip


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    trials = [
        *(made(number) for number in range(20)),
        *(made(number, planner="networks", placed=[0.002, 0, 0.01]) for number in range(19)),
        failed(19, planner="networks"),
        *(made(number, condition=NOISY) for number in range(10)),
    ]
    headline, _ = write_report(
        out, PART, grasps(), trials, parse_tolerance("1mm,2deg"), dict(quick=False, seed=0)
    )
    return out, headline


def test_the_first_line_is_the_verdict(written):
    out, headline = written
    assert headline.startswith("With an exact camera: correct by the prediction: 20 of 20")
    assert "With Kinect v2 noise: " in headline
    values = json.loads((out / "report.json").read_text())
    assert values["headline"] == headline and values["rows"][0]["within"]["predicted"]["n"] == 20


def test_the_page_works_by_itself_and_shows_the_part_in_3d(written, tmp_path):
    out, headline = written
    with Page(out / "report.html") as page:
        assert headline in page.evaluate("document.querySelector('.conclusion').textContent")
        page.evaluate("document.querySelector('iframe').loading = 'eager'")
        page.evaluate("document.querySelector('iframe').scrollIntoView()")
        page.evaluate("new Promise(done => setTimeout(done, 3000))")
        page.screenshot(tmp_path / "page.png")
        top, height = page.evaluate(
            "(r => [r.top + scrollY, r.height])(document.querySelector('iframe').getBoundingClientRect())"
        )
        complaints = [one for one in page.complaints if "WebGL" not in one and "GPU" not in one]
        assert complaints == []
    scene = cv2.imread(str(tmp_path / "page.png"))[int(top) : int(top + height)].astype(int)
    blue, _, red = np.moveaxis(scene, -1, 0)
    assert (blue - red > 60).sum() > 500  # the hand
    assert (red - blue > 30).sum() > 50  # the part as it is expected in it
    text = (out / "report.html").read_text()
    assert "http://" not in text.split("<iframe")[0] and 'src="http' not in text
    assert 'sandbox="allow-scripts"' in text


def test_a_part_that_nothing_lifts_gets_a_report_that_says_so_first(tmp_path):
    none = certified(
        without={5: "it is rare (probability 1.0%)"}
        | {0: "no grasp lifts it in 95% of the simulations (best 0%)"},
        conditions=CONDITIONS,
    )
    trials = [
        failed(number, "refused", planner=planner, condition=condition)
        for number in range(2)
        for planner in ("certified", "networks")
        for condition in (EXACT, NOISY)
    ]
    headline, _ = write_report(tmp_path, PART, none, trials, parse_tolerance("1mm,2deg"), {})
    assert headline.startswith("hex_nut_m20 was not grasped: none of 8 attempts lifted it (")
    assert "refused" in headline and "no grasp lifts it" in headline and "rare" not in headline
    assert "by 2 scenes: 0 to 66%" in headline  # in which both planners plan the same


def test_of_a_part_without_opposite_faces_no_width_is_stated(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    trimesh.creation.cone(20.0, 4.0, sections=64).export(tmp_path / "cone.stl")
    part = import_part(tmp_path / "cone.stl")
    assert np.isinf(least_widths(part)).all()
    said = conclusion(part, certified(conditions=CONDITIONS), [failed(0, "refused")], {})
    assert said.startswith(
        "cone has no two opposite faces that fingers could hold, in any resting pose. None of 1 attempts "
        "lifted it (refused 1"
    )


def test_a_part_that_is_too_heavy_was_not_tried(tmp_path):
    trials = [
        failed(0, "too heavy for the arm (4.2 kg)", planner=planner, planned_by=None)
        for planner in ("certified", "networks")
    ]
    known = certified(certified_grasp(), conditions=CONDITIONS)
    headline, _ = write_report(tmp_path, PART, known, trials, parse_tolerance("1mm,2deg"), {})
    assert headline == (
        "hex_nut_m20 was not grasped: none of 2 attempts could be made (too heavy for the arm (4.2 kg) 2)."
    )


def test_every_grasp_says_whether_it_is_certified(tmp_path):
    slipping = certified_grasp(resting=2, lifted=20)
    known = certified(certified_grasp(), uncertified=(slipping,), conditions=CONDITIONS)
    write_report(tmp_path, PART, known, [made(0)], parse_tolerance("1mm,2deg"), {})
    table = (tmp_path / "report.html").read_text().split("All grasps</h2>")[1]
    found = re.findall(r"<td[^>]*>(yes|no)</td>", table)
    assert found == ["yes", "no"]


def test_a_pose_in_which_the_part_always_tilts_is_told_with_its_grasps():
    tilting = certified_grasp(resting=2, swing=np.array([0.2, 0.0]))
    known = certified(
        certified_grasp(), uncertified=(tilting,), without={2: "it tilts"}, like={}, conditions=CONDITIONS
    )
    section = poses_section(PART, known, Path("grasps.png"))
    assert "friction 0.2 to 0.6, force 40 to 40 N a pad, and the arm's 0.2 mm" in section.text[0]
    (table,) = section.tables
    (row,) = (row for row in table.rows if row[0] == "2")
    assert row[2] == "180 degrees"
    assert row[3] == 0 and row[5] == "it tilts; planned with the best that was simulated"
