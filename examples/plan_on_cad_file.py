"""Plan a grasp of a part from its CAD file, in the simulated cell, and perform it.

python examples/plan_on_cad_file.py [part.stl]
"""

import sys

import numpy as np

from mskgrasp import (
    Planner,
    PlannerConfig,
    config_file,
    example_file,
    execute_grasp,
    load_models,
    load_part,
    open_cell,
)


def main(cad_file: str) -> None:
    part = load_part(cad_file, unit="mm")
    print(f"{part.name}: {part.mass * 1e3:.0f} g, {len(part.resting_probability)} resting poses")

    with open_cell(config_file("cells/sapien.yaml")) as cell:
        planner = Planner.of_workspace(load_models(), PlannerConfig(), cell.workspace)
        assert cell.feeder is not None  # the simulated cell has one
        cell.feeder.present(str(part.folder), seed=0)
        plan = planner.plan(cell.camera.capture(), np.random.default_rng(0))
        x, y, z = plan.grasp.position
        print(f"grasp at {x:.3f}, {y:.3f}, {z:.3f} m, {np.degrees(plan.grasp.theta):.0f} degrees")
        print(f"predicted quality {plan.quality:.2f}")
        shift, std = plan.displacement[:3] * 1e3, plan.displacement_std[:3] * 1e3
        print(f"predicted shift in the hand {np.round(shift, 1)} +- {np.round(std, 1)} mm")

        result = execute_grasp(cell, plan.grasp, load=plan.load_of(part))
        print("lifted" if result.holding else "not lifted")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else str(example_file("bracket.stl")))
