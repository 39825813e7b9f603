import pytest

from mskgrasp.core.config import check_config
from mskgrasp.core.errors import BadConfig
from mskgrasp.planning.config import PlannerConfig


@pytest.mark.parametrize(
    "values", [{"n_candidates": 0}, {"top_fraction": 0.0}, {"policy": "best"}, {"unknown": 1}]
)
def test_settings_that_make_no_plan_are_refused_by_name(values):
    with pytest.raises(BadConfig, match=next(iter(values))):
        check_config(PlannerConfig, values, "x.yaml")
