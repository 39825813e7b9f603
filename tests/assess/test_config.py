import numpy as np
import pytest
from pydantic import ValidationError

from mskgrasp.assess.config import LEAST_SIMULATIONS, AssessConfig, parse_tolerance
from mskgrasp.core.errors import BadConfig
from mskgrasp.runtime.options import parse
from mskgrasp.simulation.certify import CertifyConfig


@pytest.mark.parametrize(
    ("text", "distance", "angle"),
    [
        ("1mm,2deg", 1e-3, np.radians(2)),
        (" 0.5 mm , 0.01 rad", 5e-4, 0.01),
        ("0.002m,1deg", 2e-3, np.radians(1)),
    ],
)
def test_a_tolerance_is_a_distance_and_an_angle(text, distance, angle):
    found = parse_tolerance(text)
    assert (found.distance, found.angle) == (pytest.approx(distance), pytest.approx(angle))


def test_a_tolerance_reads_as_a_user_would_say_it():
    assert str(parse_tolerance("1mm,2deg")) == "1 mm and 2 degrees"


@pytest.mark.parametrize(
    "text", ["1mm", "1,2", "1mm,2", "0mm,1deg", "-1mm,2deg", "1.2.3mm,2deg", "200mm,2deg", "1mm,200deg"]
)
def test_another_text_is_refused_with_an_example(text):
    with pytest.raises(BadConfig, match="such as 1mm,2deg"):
        parse(AssessConfig, prog="assess", description="", argv=["bracket.stl", "--tolerance", text])


def test_as_few_simulations_are_asked_for_as_a_certification_takes():
    assert CertifyConfig(simulations=LEAST_SIMULATIONS).simulations == LEAST_SIMULATIONS
    with pytest.raises(ValidationError):
        CertifyConfig(simulations=LEAST_SIMULATIONS - 1)


def test_parts_come_first_and_quick_makes_less():
    found = parse(AssessConfig, prog="assess", description="", argv=["a.stl", "b", "--quick"])
    assert found.parts == ("a.stl", "b")
    assert found.n_simulations < AssessConfig().n_simulations and found.n_trials < AssessConfig().n_trials
    assert AssessConfig(quick=True, trials=30).n_trials == 30
