import torch

from mskgrasp.learning.grasp_models import ModelMeta, build_models
from mskgrasp.learning.network_config import Normalisation, PatchNetworkConfig
from mskgrasp.planning.config import PlannerConfig
from mskgrasp.planning.planner import Planner
from tests import synthetic
from tests.synthetic import REGION, Box

BOX = Box(x=0.45, y=0.02, yaw=0.4, size=(0.07, 0.02, 0.03))


FRAME = synthetic.frame([BOX])


def hand_made_models(variance=True):
    """Networks of one action feature: quality falls with |centre x|, variance with centre y.

    The action input is (x, y, z) / scale. Feature k of the trunk is relu(+-x) or relu(+-y); the image is
    cut off by zero weights.
    """
    config = PatchNetworkConfig(
        patch_pixels=32,
        channels=1,
        trunk_width=1,
        action_width=4,
        head_width=4,
        dropout=0.0,
        variance=variance,
    )
    meta = ModelMeta(network=config, normalisation=Normalisation(action_scale=(0.05, 0.05, 0.05)))
    models = build_models(meta)
    with torch.no_grad():
        for network in (models.gqn, models.gdn):
            for parameter in network.parameters():
                parameter.zero_()
            network.features.action[0].weight.copy_(
                torch.tensor([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0]])
            )
        copy = torch.cat([torch.zeros(4, 1), torch.eye(4)], dim=1)  # pass the action features on
        models.gqn.head[0].weight.copy_(copy)
        models.gqn.head[3].weight[1] = torch.tensor([-4.0, -4.0, 0.0, 0.0])
        if variance:
            models.gdn.variance_head[0].weight.copy_(copy)
            models.gdn.variance_head[3].weight[:] = torch.tensor([0.0, 0.0, 5.0, -5.0])
            models.gdn.variance_head[3].bias.fill_(-8.0)
        models.gdn.mean_head[3].bias.copy_(torch.tensor([0.001, 0.002, 0.0, 0.1]))
    return models


def planner(config=None, models=None, **settings):
    return Planner(
        models or hand_made_models(),
        config or PlannerConfig(n_candidates=600),
        table_z=0.0,
        region=REGION,
        **settings,
    )
