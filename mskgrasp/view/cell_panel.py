"""Panel of a cell: plans on it live, and executes them once that is confirmed."""

from __future__ import annotations

import time

import numpy as np
from viser import GuiButtonHandle, GuiEvent

from hal import go_home, put_down
from hal.camera import RgbdFrame
from hal.errors import HandFull
from hal.simulated import SimulatedWorld
from mskgrasp.core.errors import NoGraspFound, NoPartFound
from mskgrasp.core.geometry import Pose
from mskgrasp.parts import Part, find_part
from mskgrasp.planning.certified_planner import planner_of_part
from mskgrasp.planning.for_cell import make_planner, present
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.plan_text import plan_text
from mskgrasp.trials.engine import TrialEngine
from mskgrasp.view.config import ViewConfig
from mskgrasp.view.dataset_panel import shift_text
from mskgrasp.view.live_arm import LiveArm
from mskgrasp.view.main_thread import Work
from mskgrasp.view.page import Page, Panel, plain
from mskgrasp.view.plan_view import PlanView, Shown
from mskgrasp.view.scene import part_mesh

LIVE_S = 0.3
"""Least time between two live plans, s."""


class CellPanel(Panel):
    """A connected cell.

    Args:
        page: The page.
        engine: Steps of a trial on the cell.
        config: Settings of the viewer.
        part: The part on the table; None: not known.

    Raises:
        BadModel: The model cannot be used, or was made for another hand.
        HalError: The cell cannot present the part.
    """

    def __init__(self, page: Page, engine: TrialEngine, config: ViewConfig, part: Part | None):
        super().__init__(page, "cell")
        self.engine, self.cell = engine, engine.cell
        self._config, self._part = config, part
        self._seed = config.seed
        self.plan: GraspPlan | None = None
        self._n_stops = 0
        self._frame: RgbdFrame | None = None
        planner = make_planner(config.models, config.planner.for_motion(), self.cell)
        if self._part is None and isinstance(self.cell.feeder, SimulatedWorld):
            self._part = find_part(self.cell.feeder.part)
        self._planner = planner if self._part is None else planner_of_part(planner, self.cell, self._part)
        self._mesh = None if self._part is None else part_mesh(self._part)
        self._add_controls()
        self.arm = LiveArm(page, self.root.name, self.cell, self._mesh)
        if part is not None and self.cell.feeder is not None:
            present(self.cell, str(part.folder), self._seed)
        self.arm.look()

    def _add_controls(self) -> None:
        gui, may_move = self.page.gui, self._config.allow_motion
        off = None if may_move else "start with --allow-motion to enable it"
        with self.folder:
            self.plan_button = gui.add_button("plan", color="blue")
            self.live = gui.add_checkbox("plan live", False, disabled=self.cell.recorded)
            self.present_button = gui.add_button(
                "present the part anew", visible=self.cell.feeder is not None and self._part is not None
            )
            self.execute_button = gui.add_button("execute ...", disabled=True, hint=off)
            self.stop_button = gui.add_button("stop", color="red", disabled=not may_move)
            self.recover_button = gui.add_button("recover and go home ...", disabled=not may_move, hint=off)
            self.text = gui.add_markdown("")
            self.view = PlanView(self.page, self)
        self.on(self.plan_button, self.plan_once)
        self.on(self.live, self._set_live)
        self.on(self.present_button, self.present)
        self.execute_button.on_click(self._ask_to_execute)
        self.recover_button.on_click(self._ask_to_recover)
        # At once, from the callback's own thread: the main thread waits for the motion.
        self.stop_button.on_click(lambda _: self._stop())

    def shown(self) -> None:
        """Plan, if nothing has been planned yet."""
        if self.plan is None and not self.cell.recorded:
            self.plan_once()

    # ------------------------------------------------------------------ planning

    def plan_once(self) -> None:
        """Take a frame, plan and draw the plan.

        Raises:
            ArmInView: The arm is not at home.
            HalError: The cell was lost.
        """
        self._set_plan(None)
        frame = self._frame = self.engine.capture()
        try:
            plan = self._planner.plan(frame, np.random.default_rng(self._seed))
        except (NoPartFound, NoGraspFound) as error:
            self.text.content = f"**no plan**: {plain(error)}"
            self._show(frame, None)
            return
        self._set_plan(plan)
        self.text.content = in_markdown(plan_text(plan))
        self._show(frame, plan)

    def present(self) -> None:
        """Have the feeder place the part at another place, and plan.

        Raises:
            HalError: The cell has no feeder, or was lost.
        """
        part = self._part
        assert part is not None, "the button is shown where the part is known"
        self._seed += 1
        present(self.cell, str(part.folder), self._seed)
        self.arm.look()
        self.plan_once()

    def _set_live(self) -> None:
        last = 0.0

        def again() -> None:
            nonlocal last
            if self.root.visible and time.monotonic() - last > LIVE_S:
                try:
                    self.plan_once()
                finally:  # an error is not met, and printed, thirty times a second
                    last = time.monotonic()

        self.page.main.repeat("live", again if self.live.value else None)

    def _set_plan(self, plan: GraspPlan | None) -> None:
        self.plan = plan
        self.execute_button.disabled = plan is None or not self._config.allow_motion

    def _show(
        self,
        frame: RgbdFrame,
        plan: GraspPlan | None,
        measured: np.ndarray | None = None,
        before: Pose | None = None,
    ) -> None:
        workspace = self.cell.workspace
        pose = before or self.arm.part_pose()
        if pose is None and plan is not None and plan.pose is not None:
            pose = plan.pose.T_base_obj
        self.view.show(
            Shown(
                frame=frame,
                table_z=workspace.table_z,
                region=workspace.region,
                plan=plan,
                mesh=self._mesh,
                T_base_obj=pose,
                measured=measured,
                point_base=None if before is None else np.asarray(before.position),
            )
        )

    # ------------------------------------------------------------------ motion

    def execute(self, plan: GraspPlan) -> None:
        """Grasp as planned, lift, put the part down where it was, and go home.

        Nothing moves without ``allow_motion``, nor where the plan is no longer the one on the page.

        Raises:
            NotCalibrated: The camera's pose was measured by hand; nothing moves.
            HandFull: The hand holds something, such as of an earlier program; nothing moves.
            HalError: The cell was lost, or the arm was stopped.
        """
        frame, tallest = self._frame, self.engine.passed
        if not self._config.allow_motion or frame is None:
            return
        if plan is not self.plan:
            self.page.tell("the plan has changed since; nothing moved")
            return
        if self.cell.arm.in_hand() is not None:
            raise HandFull(
                "the hand holds something, which would fall as the fingers open; nothing moved: press "
                "'recover and go home', with the part in your hand on a real cell, then plan again"
            )
        self._set_plan(None)  # the part will lie elsewhere
        self.page.tell("the arm moves ...")
        with self.arm.in_motion():
            done = self.engine.grasp(plan, self._part)
            result = done.result
            if result is None:
                self.page.tell(
                    "the arm refuses this grasp, or part of the way; if it is over the part or holds it, "
                    "recover and go home"
                )
                return
            if result.aborted is not None:
                self.page.tell(f"**the arm stopped**: {plain(result.aborted)}")
                return
            text = f"not lifted ({plain(done.reason)})" if done.reason else "lifted and held"
            if done.displacement is not None and done.before is not None:
                text += f"; the part's origin moved {shift_text(done.displacement)}"
                self._show(frame, plan, done.displacement, done.before)
            if result.holding:
                put_down(self.cell, plan.grasp, tallest=tallest)
            go_home(self.cell, tallest=tallest)
        self.page.tell(f"{text}; plan again")

    def recover(self) -> None:
        """Acknowledge a stop and move the arm home; nothing moves without ``allow_motion``.

        Raises:
            HalError: The cause is still present.
        """
        if not self._config.allow_motion:
            return
        self._set_plan(None)
        self.page.tell("the arm moves ...")
        with self.arm.in_motion():
            self.cell.arm.recover()
            # Whoever said yes holds what is in the hand of a real arm; a simulated one puts it down.
            go_home(self.cell, tallest=self.engine.passed, take=lambda: True)
        self.page.tell("the arm is at home; plan again")

    def _stop(self) -> None:
        if self._config.allow_motion:
            self._n_stops += 1
            self.cell.arm.stop()

    def _ask_to_execute(self, event: GuiEvent[GuiButtonHandle]) -> None:
        self.live.value = False  # the plan stays as it is while the question is open
        plan = self.plan
        if plan is None:  # pressed while a live plan was computed
            self.page.tell("there is no plan to execute; plan again")
        else:
            way = f"lifts by {self.cell.workspace.lift_height:g} m, puts the part down and goes home"
            question = f"{plain(plan.summary)}. The arm grasps, {way}. Keep clear of it. May it move?"
            self._ask(event, question, lambda: self.execute(plan))

    def _ask_to_recover(self, event: GuiEvent[GuiButtonHandle]) -> None:
        self.live.value = False
        full = (
            "puts down what it holds"
            if self.cell.arm.simulated
            else "opens the fingers (**hold what is between them: it falls**)"
        )
        question = f"The arm acknowledges its stop, {full}, rises and goes home. May it move?"
        self._ask(event, question, self.recover)

    def _ask(self, event: GuiEvent[GuiButtonHandle], question: str, work: Work) -> None:
        """Ask on the page of the one who pressed a button; a yes has the main thread do the work."""
        if event.client is None or not self._config.allow_motion:
            return
        gui = event.client.gui
        modal = gui.add_modal("May the arm move?")
        before = self._n_stops
        with modal:
            gui.add_markdown(question)
            yes, no = gui.add_button("yes, move", color="red"), gui.add_button("no")

        def agreed(_: GuiEvent) -> None:
            modal.close()

            def move() -> None:
                # A recovery would lift a stop of since: while the question was open, or other work was done.
                if self._n_stops == before:
                    work()
                else:
                    self.page.tell("the arm was stopped before it moved; nothing moved")

            self.page.main.submit("motion", move)

        yes.on_click(agreed)
        no.on_click(lambda _: modal.close())


def in_markdown(text: str) -> str:
    """Lines of a name and its values, two spaces apart or more, as Markdown that a narrow panel wraps."""
    rows = (line.split("  ", 1) for line in text.splitlines())
    return "\n\n".join(f"**{name}** {plain(values.strip())}" for name, values in rows)
