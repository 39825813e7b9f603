"""One grasp, planned, carried out and filmed in the simulated cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hal import capture_at_home, execute_grasp, open_cell
from hal.sim import Film, SapienWorld
from mskgrasp.core.shipped import PRETRAINED, SIMULATED_CELL
from mskgrasp.demo.animation import write_animation
from mskgrasp.demo.config import DemoConfig
from mskgrasp.parts import find_part
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.for_cell import make_planner, part_name, present
from mskgrasp.planning.grasp_figures import draw_plan
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.runtime.cli import make_folder
from mskgrasp.runtime.progress import progress

STAGES = ("import the part", "open the cell", "plan", "grasp", "draw")


@dataclass(frozen=True, kw_only=True)
class Demo:
    """Outcome of the first grasp.

    Attributes:
        plan: The plan.
        failure: Why the part was not lifted; empty where it was.
        displacement: (4,) measured displacement of the part's seen centre, grasp frame, metres and radians.
    """

    plan: GraspPlan
    failure: str
    displacement: np.ndarray


def demonstrate(config: DemoConfig) -> Demo:
    """Plan a grasp, carry it out, and write plan.png and grasp.gif.

    Raises:
        MskgraspError: The part cannot be used, or no grasp was found.
    """
    make_folder(config.out)
    with progress(total=len(STAGES), unit="stage", title=STAGES[0], keep=True) as bar:

        def done() -> None:
            bar.update()
            bar.set_description(STAGES[min(bar.n, len(STAGES) - 1)])

        part = find_part(part_name(config.part, config.unit))
        done()
        with open_cell(SIMULATED_CELL) as cell:
            world = cell.feeder
            assert isinstance(world, SapienWorld)
            # Recentred, the part would hardly move, and there would be little to see.
            planner = make_planner(PRETRAINED, PlannerConfig(recentre=False), cell)
            present(cell, str(part.folder), config.seed)
            done()
            frame = capture_at_home(cell)
            plan = planner.plan(frame, np.random.default_rng(config.seed))
            done()
            with Film(world, plan.grasp).recorded() as film:
                result = execute_grasp(cell, plan.grasp, load=plan.load_of(part))
            done()
        moved = write_animation(film, plan, config.out / "grasp.gif")
        draw_plan(frame, plan, config.out / "plan.png", measured=moved if result.holding else None)
        done()
    failure = "" if result.holding else result.aborted or "it is not in the hand after the lift"
    return Demo(plan=plan, failure=failure, displacement=moved)


def demo_text(demo: Demo) -> str:
    """Predicted and measured shift of the part's seen centre in the hand, a line each, or why it failed."""
    if demo.failure:
        return f"the part was not lifted: {demo.failure}; try another --seed"
    predicted, std = demo.plan.displacement, demo.plan.displacement_std
    expected = ", ".join(
        f"{name} {1e3 * predicted[k]:+z.1f} +- {1e3 * std[k]:.1f} mm" for k, name in enumerate(("dx", "dy"))
    )
    measured = ", ".join(
        f"{name} {1e3 * demo.displacement[k]:+z.1f} mm" for k, name in enumerate(("dx", "dy"))
    )
    turns = [np.degrees(one[3]) for one in (predicted, std, demo.displacement)]
    return (
        f"lifted, predicted quality {demo.plan.quality:.2f}\n"
        f"shift in the hand, expected  {expected}, turn {turns[0]:+z.1f} +- {turns[1]:.1f} deg\n"
        f"shift in the hand, measured  {measured}, turn {turns[2]:+z.1f} deg"
    )
