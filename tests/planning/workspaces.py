"""The workspace of the synthetic frames."""

import numpy as np

from hal import Workspace
from tests.synthetic import REGION, TABLE_Z

WORKSPACE = Workspace(
    table_z=TABLE_Z, region=REGION, home=np.zeros(7), min_height=0.002, lift_height=0.1, grasp_force=30.0
)
