"""Plans made of other planners' grasps, and what is said of planners that cannot be used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hal.errors import BadBackend
from mskgrasp.core.errors import BadConfig, BadPlanner, NoGraspFound, NoPartFound
from mskgrasp.core.grasp import Grasp
from mskgrasp.planning.proposal import (
    OtherPlanner,
    ProposedGrasp,
    installed_planner,
    plan_of,
    view_of,
)
from tests import synthetic
from tests.planning.hand_made import BOX, FRAME
from tests.planning.workspaces import WORKSPACE

VIEW = view_of(FRAME, WORKSPACE)
GRASP = Grasp.from_vector(np.array([0.45, 0.02, 0.015, 0.4]))
MOVED = np.array([0.002, -0.001, 0.0005, 0.05])
SPREAD = np.diag([1e-6, 4e-6, 1e-6, 1e-4])


def proposed(**changes) -> ProposedGrasp:
    values = dict(grasp=GRASP, quality=0.8, displacement=MOVED, displacement_cov=SPREAD)
    return ProposedGrasp(**(values | changes))


@given(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
def test_the_displacement_of_the_stated_point_is_the_predicted_one(x, y):
    point = np.array([BOX.x + x, BOX.y + y, 0.01])
    plan = plan_of(proposed(point_base=point), VIEW, 0.1)
    mean, covariance = plan.displacement_of(point)
    assert mean == pytest.approx(MOVED, abs=1e-12)
    assert covariance == pytest.approx(SPREAD, abs=1e-12)


def test_without_a_point_the_displacement_is_that_of_the_seen_centre():
    plan = plan_of(proposed(), VIEW, 0.1)
    assert plan.displacement == pytest.approx(MOVED, abs=1e-12)
    assert plan.quality == 0.8
    radius = VIEW.gyration_radius
    assert plan.score == pytest.approx(6e-6 + radius**2 * 1e-4)


def test_a_grasp_beyond_half_a_turn_is_the_same_with_its_axes_reversed():
    turned = Grasp.from_vector(np.array([0.45, 0.02, 0.015, 0.4 + np.pi]))
    reversed_ = MOVED * [-1, -1, 1, 1]
    plan = plan_of(proposed(grasp=turned, displacement=reversed_), VIEW, 0.1)
    assert plan.grasp.theta == pytest.approx(0.4)
    assert plan.displacement == pytest.approx(MOVED, abs=1e-12)


def test_what_is_not_predicted_is_zero_or_unknown():
    plan = plan_of(ProposedGrasp(grasp=GRASP), VIEW, 0.1)
    assert plan.displacement == pytest.approx(np.zeros(4)) and np.isnan(plan.quality)
    assert plan.planned_by == "another planner"
    assert np.isnan(plan.displacement_cov).all() and np.isnan(plan.score)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (dict(quality=1.5), "quality is 1.5"),
        (dict(displacement=np.zeros(3)), "displacement must be finite and of shape"),
        (dict(displacement_cov=np.full((4, 4), np.nan)), "displacement_cov must be finite"),
        (dict(displacement_cov=np.diag([-1e-6, 1e-6, 1e-6, 1e-4])), "displacement_cov is no covariance"),
        (dict(displacement_cov=SPREAD + np.eye(4, k=1) * 1e-7), "displacement_cov is no covariance"),
        (dict(grasp=Grasp.from_vector(np.array([0.4, np.nan, 0.1, 0.0]))), "grasp must be finite"),
    ],
)
def test_impossible_values_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        plan_of(proposed(**changes), VIEW, 0.1)


class Answers:
    def __init__(self, answer):
        self.answer = answer

    def plan(self, frame, rng):
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


@pytest.mark.parametrize(
    ("answer", "error", "message"),
    [
        (RuntimeError("no licence\nbuy one"), BadPlanner, "'theirs' fails: RuntimeError: no licence; repair"),
        (NoGraspFound("too wide"), NoGraspFound, "too wide"),
        (None, BadPlanner, "'theirs' answers no grasp"),
        (proposed(quality=2.0), BadPlanner, "'theirs' answers no grasp: ValueError: quality is 2"),
    ],
)
def test_an_error_of_another_planner_is_one_line(answer, error, message):
    with pytest.raises(error, match=message) as caught:
        OtherPlanner(Answers(answer), WORKSPACE, "theirs").plan(FRAME, np.random.default_rng(0))
    assert "\n" not in str(caught.value)


def test_a_plan_is_taken_as_it_is_and_an_empty_table_is_not_asked_about():
    plan = plan_of(proposed(), VIEW, 0.1)
    planner = OtherPlanner(Answers(plan), WORKSPACE, "theirs")
    assert planner.plan(FRAME, np.random.default_rng(0)) is plan
    with pytest.raises(NoPartFound):
        planner.plan(synthetic.frame([]), np.random.default_rng(0))


CODE = """
from mskgrasp.core.grasp import Grasp
from mskgrasp.planning.proposal import ProposedGrasp
import numpy as np

class Fixed:
    def __init__(self, workspace): self.x = workspace.region[0]
    def plan(self, frame, rng):
        return ProposedGrasp(grasp=Grasp.from_vector(np.array([self.x, 0.0, 0.02, 0.1])))

def nothing(workspace): return None
def fails(workspace): raise OSError("no file")
"""


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Installs a package of a name with entry points into ``NAME_planner``."""

    def package(name: str, points: dict[str, str], code: str = CODE) -> None:
        site = tmp_path / name
        info = site / f"{name}-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        lines = [f"{point} = {name}_planner:{value}" for point, value in points.items()]
        (info / "entry_points.txt").write_text("[mskgrasp.planners]\n" + "\n".join(lines) + "\n")
        (site / f"{name}_planner.py").write_text(code)
        monkeypatch.syspath_prepend(str(site))

    return package


def made(name: str) -> OtherPlanner:
    return installed_planner(name, ("ours",), WORKSPACE, "--planners")


def test_a_planner_of_an_installed_package_is_made_for_the_workspace(install):
    install("acme", {"fixed": "Fixed"})
    plan = made("fixed").plan(FRAME, np.random.default_rng(0))
    assert plan.grasp.as_vector() == pytest.approx([WORKSPACE.region[0], 0.0, 0.02, 0.1])


def test_an_unknown_name_lists_all(install):
    install("acme2", {"fixed": "Fixed"})
    with pytest.raises(
        BadConfig, match=r"--planners is 'fixd'; legal: ours \(built in\), fixed \(package acme2"
    ):
        made("fixd")


def test_a_name_that_two_packages_offer_is_refused(install):
    install("acme3", {"fixed": "Fixed"})
    install("bolt3", {"fixed": "Fixed"})
    with pytest.raises(BadBackend, match="is offered by package"):
        made("fixed")


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("nothing", "must be a function that returns an object with plan"),
        ("fails", "cannot be made: OSError: no file; repair or uninstall it"),
        ("missing", "cannot be made: AttributeError"),
    ],
)
def test_a_package_that_offers_no_planner_is_refused(value, message, install):
    install(f"broken_{value}", {"other": value})
    with pytest.raises(BadPlanner, match=message):
        made("other")
