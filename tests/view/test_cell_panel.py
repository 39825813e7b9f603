"""Panel of a cell: plans, and motions that are asked for."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from hal.arm_state import Held
from hal.errors import CommunicationLost
from hal.simulated import SimulatedArm
from mskgrasp.core.config import Config
from mskgrasp.core.shipped import SIMULATED_CELL
from mskgrasp.parts import find_part
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.trials.engine import TrialEngine, connected_engine
from mskgrasp.view.cell_panel import CellPanel, in_markdown
from mskgrasp.view.config import ViewConfig
from mskgrasp.view.page import Page
from tests.view.conftest import has_node, pose_of, work

PART = "hex_nut_m30"
FEW = PlannerConfig(n_candidates=200)


@pytest.fixture(scope="module")
def engine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TrialEngine]:
    picture = tmp_path_factory.mktemp("view") / "next.png"
    with connected_engine(SIMULATED_CELL, yes=True, picture=picture, tape=None) as engine:
        yield engine


def panel_of(page: Page, engine: TrialEngine, **settings: object) -> CellPanel:
    config = ViewConfig(planner=FEW, seed=3).model_copy(update=settings)
    assert isinstance(config, Config)
    return CellPanel(page, engine, config, find_part(PART))


class AskedGui:
    """Stands in for the controls of one browser: keeps the buttons of the question."""

    def __init__(self, gui) -> None:
        self._gui, self.buttons, self.text = gui, {}, ""

    def add_modal(self, title: str):
        return self._gui.add_modal(title)

    def add_markdown(self, text: str) -> None:
        self.text = text

    def add_button(self, label: str, **settings: object):
        self.buttons[label] = self._gui.add_button(label, **settings)
        return self.buttons[label]


def asked(page: Page, ask) -> AskedGui:
    """The question that a browser shows once a button is pressed there."""
    gui = AskedGui(page.gui)
    ask(SimpleNamespace(client=SimpleNamespace(gui=gui)))
    return gui


def test_a_plan_is_drawn_and_described_and_moves_nothing(page: Page, engine: TrialEngine):
    panel = panel_of(page, engine)
    before = engine.cell.arm.state().joints
    panel.shown()
    plan = panel.plan
    assert plan is not None and f"{plan.quality:.3f}" in panel.text.content
    np.testing.assert_allclose(pose_of(page, "/cell/plan/chosen").position, plan.grasp.position)
    pose = engine.part_pose()
    assert pose is not None
    np.testing.assert_allclose(pose_of(page, "/cell/part").position, pose.position, atol=1e-6)
    panel.present_button.value = True
    work(page)
    moved = engine.part_pose()
    assert moved is not None and np.linalg.norm(moved.position - pose.position) > 0.005
    assert panel.plan is not plan
    np.testing.assert_array_equal(engine.cell.arm.state().joints[:7], before)


def test_without_the_flag_no_button_and_no_call_moves_the_arm(page: Page, engine: TrialEngine, monkeypatch):
    panel = panel_of(page, engine)
    panel.plan_once()
    assert panel.plan is not None
    assert panel.execute_button.disabled and panel.recover_button.disabled and panel.stop_button.disabled
    monkeypatch.setattr(engine.cell.arm, "move_to_pose", lambda *_, **__: pytest.fail("the arm moved"))
    monkeypatch.setattr(engine.cell.arm, "stop", lambda: pytest.fail("the arm was stopped"))
    # What a forged message of a client would do.
    assert asked(page, panel._ask_to_execute).buttons == {}
    assert asked(page, panel._ask_to_recover).buttons == {}
    panel.stop_button.value = True
    panel.execute(panel.plan)
    panel.recover()


def test_the_arm_moves_only_after_a_yes_and_only_for_the_plan_that_was_asked_for(
    page: Page, engine: TrialEngine
):
    panel = panel_of(page, engine, allow_motion=True)
    panel.plan_once()
    home = engine.cell.arm.state().joints
    question = asked(page, panel._ask_to_execute)
    assert "May it move?" in question.text
    question.buttons["no"].value = True
    work(page)
    question = asked(page, panel._ask_to_execute)
    panel.plan_once()
    question.buttons["yes, move"].value = True
    work(page)
    assert "nothing moved" in page.said
    np.testing.assert_array_equal(engine.cell.arm.state().joints, home)


def test_a_yes_grasps_lifts_puts_down_and_goes_home(page: Page, engine: TrialEngine, monkeypatch):
    monkeypatch.setattr("mskgrasp.view.live_arm.time.sleep", lambda _: None)
    panel = panel_of(page, engine, allow_motion=True)
    panel.plan_once()
    heights: list[float] = []
    look = panel.arm.look
    monkeypatch.setattr(
        panel.arm, "look", lambda: (look(), heights.append(pose_of(page, "/cell/part").position[2]))
    )
    monkeypatch.setattr("mskgrasp.view.live_arm.FRAME_S", 0.0)
    asked(page, panel._ask_to_execute).buttons["yes, move"].value = True
    work(page)
    assert page.said.startswith("lifted and held") and has_node(page, "/cell/plan/measured")
    assert max(heights) > heights[0] + 0.08 > heights[-1] + 0.07  # it was up, and lies again
    assert np.abs(engine.cell.arm.state().joints - engine.cell.workspace.home).max() < 0.01
    assert panel.plan is None and panel.execute_button.disabled
    assert asked(page, panel._ask_to_execute).buttons == {} and page.said.startswith("there is no plan")


def test_stop_ends_a_motion_at_once_and_recovery_is_asked_for(page: Page, engine: TrialEngine, monkeypatch):
    monkeypatch.setattr("mskgrasp.view.live_arm.time.sleep", lambda _: None)
    panel = panel_of(page, engine, allow_motion=True)
    panel.plan_once()
    arm = engine.cell.arm
    assert isinstance(arm, SimulatedArm)
    looks = 0
    look = panel.arm.look

    def press() -> None:
        panel.stop_button.value = True

    def stop_soon() -> None:
        nonlocal looks
        look()
        looks += 1
        if looks == 3:
            pressing = threading.Thread(target=press)
            pressing.start()
            pressing.join()

    monkeypatch.setattr(panel.arm, "look", stop_soon)
    monkeypatch.setattr("mskgrasp.view.live_arm.FRAME_S", 0.0)
    asked(page, panel._ask_to_execute).buttons["yes, move"].value = True
    work(page)
    assert "Stopped" in page.said
    away = np.abs(arm.state().joints - engine.cell.workspace.home).max()
    panel.plan_button.value = True
    work(page)
    question = asked(page, panel._ask_to_recover)
    assert "acknowledges its stop, puts down what it holds, rises and goes home" in question.text
    question.buttons["yes, move"].value = True
    work(page)
    assert page.said == "the arm is at home; plan again"
    assert np.abs(arm.state().joints - engine.cell.workspace.home).max() < min(0.01, away + 0.01)


def test_a_person_who_lets_a_real_arm_recover_holds_what_is_in_its_hand(
    page: Page, engine: TrialEngine, monkeypatch
):
    panel = panel_of(page, engine, allow_motion=True)
    homed = []
    monkeypatch.setattr(type(engine.cell.arm), "simulated", False)
    monkeypatch.setattr("mskgrasp.view.cell_panel.go_home", lambda cell, **options: homed.append(options))
    question = asked(page, panel._ask_to_recover)
    assert "opens the fingers (**hold what is between them: it falls**)" in question.text
    question.buttons["yes, move"].value = True
    work(page)
    assert len(homed) == 1 and homed[0]["take"]()


def test_a_grasp_does_not_drop_what_an_earlier_program_left_in_the_hand(
    page: Page, engine: TrialEngine, monkeypatch
):
    panel = panel_of(page, engine, allow_motion=True)
    panel.plan_once()
    arm = engine.cell.arm
    monkeypatch.setattr(arm, "in_hand", lambda: Held(T_base_tcp=None, width=0.03))
    monkeypatch.setattr(arm, "open_gripper", lambda: pytest.fail("the fingers opened"))
    asked(page, panel._ask_to_execute).buttons["yes, move"].value = True
    work(page)
    assert "the hand holds something, which would fall" in page.said and panel.plan is not None


def test_a_part_that_is_not_known_is_not_presented_anew(page: Page, engine: TrialEngine, monkeypatch):
    assert panel_of(page, engine).present_button.visible
    cell = replace(engine.cell, feeder=cast(Any, SimpleNamespace()))  # as that of a recorded cell
    monkeypatch.setattr(engine, "cell", cell)
    assert not CellPanel(page, engine, ViewConfig(planner=FEW), None).present_button.visible


def test_a_stop_after_a_yes_holds_though_the_motion_has_not_begun(
    page: Page, engine: TrialEngine, monkeypatch
):
    panel = panel_of(page, engine, allow_motion=True)
    arm = engine.cell.arm
    moved: list[str] = []
    monkeypatch.setattr(arm, "recover", lambda: moved.append("recovered"))
    monkeypatch.setattr(arm, "stop", lambda: None)
    asked(page, panel._ask_to_recover).buttons["yes, move"].value = True
    panel.stop_button.value = True  # while the main thread has other work
    work(page)
    assert moved == [] and "nothing moved" in page.said


def test_a_stop_while_a_question_is_open_holds_after_the_yes(page: Page, engine: TrialEngine, monkeypatch):
    panel = panel_of(page, engine, allow_motion=True)
    arm = engine.cell.arm
    moved: list[str] = []
    monkeypatch.setattr(arm, "recover", lambda: moved.append("recovered"))
    monkeypatch.setattr(arm, "stop", lambda: None)
    question = asked(page, panel._ask_to_recover)
    panel.stop_button.value = True  # on another browser
    question.buttons["yes, move"].value = True
    work(page)
    assert moved == [] and "nothing moved" in page.said


def test_an_error_of_live_plans_is_met_no_more_often_than_a_plan(
    page: Page, engine: TrialEngine, monkeypatch
):
    panel = panel_of(page, engine)
    tries: list[int] = []

    def fail() -> None:
        tries.append(1)
        raise CommunicationLost("the cable was pulled")

    monkeypatch.setattr("mskgrasp.view.cell_panel.LIVE_S", 60.0)
    monkeypatch.setattr(engine, "capture", fail)
    panel.live.value = True
    for _ in range(4):
        page.main.work_once()
    assert len(tries) == 1 and "the cable was pulled" in page.said
    panel.live.value = False
    work(page)


def test_live_plans_follow_one_another_while_the_panel_is_shown(page: Page, engine: TrialEngine, monkeypatch):
    monkeypatch.setattr("mskgrasp.view.cell_panel.LIVE_S", 0.0)
    panel = panel_of(page, engine)
    panel.live.value = True
    plans = []
    for _ in range(4):
        page.main.work_once()
        plans.append(panel.plan)
    assert None not in plans[1:] and len({id(plan) for plan in plans[1:]}) == 3
    panel.root.visible = False
    page.main.work_once()
    assert panel.plan is plans[-1]
    panel.live.value = False
    work(page)


def test_an_empty_table_is_said_to_be_empty(page: Page, engine: TrialEngine, monkeypatch):
    panel = panel_of(page, engine)
    capture = engine.capture

    def empty():
        frame = capture()
        frame.depth[:] = np.nanmax(frame.depth)
        return frame

    monkeypatch.setattr(engine, "capture", empty)
    panel.plan_once()
    assert panel.plan is None and panel.text.content.startswith("**no plan**")
    assert has_node(page, "/cell/plan/cloud") and not has_node(page, "/cell/plan/chosen")


def test_lines_of_names_and_values_wrap():
    assert in_markdown("grasp         x 1 m\nplanned in    2 s") == "**grasp** x 1 m\n\n**planned in** 2 s"
