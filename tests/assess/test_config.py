import numpy as np
import pytest
from pydantic import ValidationError

from mskgrasp.assess.config import (
    LEAST_SIMULATIONS,
    SIMULATIONS,
    TRIALS,
    AssessConfig,
    parse_tolerance,
)
from mskgrasp.core.errors import BadConfig
from mskgrasp.parts.solids.mesh_pieces import MOST_MESH_HULLS
from mskgrasp.runtime.options import parse
from mskgrasp.simulation.certify import CertifyConfig
from mskgrasp.simulation.hull_count import USUAL_HULLS


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
    usual = AssessConfig()
    assert found.n_simulations(10) < usual.n_simulations(10) and found.n_trials(10) < usual.n_trials(10)
    assert AssessConfig(quick=True, trials=30).n_trials(10) == 30


def test_a_part_of_many_pieces_gets_fewer_simulations_and_trials_unless_they_are_asked_for():
    usual = AssessConfig()
    assert usual.n_simulations(2) == usual.n_simulations(USUAL_HULLS) == SIMULATIONS
    assert usual.n_simulations(2 * USUAL_HULLS) == SIMULATIONS / 2
    assert usual.n_trials(2 * USUAL_HULLS) == TRIALS / 2
    few = AssessConfig(quick=True)
    assert few.n_simulations(MOST_MESH_HULLS) >= 120 and few.n_trials(MOST_MESH_HULLS) >= 3
    given = AssessConfig(simulations=SIMULATIONS, trials=TRIALS)
    assert (given.n_simulations(2 * USUAL_HULLS), given.n_trials(2 * USUAL_HULLS)) == (SIMULATIONS, TRIALS)


@pytest.mark.parametrize(("quick", "n_hulls", "times"), [(True, 48, 1), (True, 120, 2.5), (False, 120, 1)])
def test_a_quick_assessment_of_many_pieces_leaves_more_poses_to_the_networks(quick, n_hulls, times):
    assert AssessConfig(quick=quick).least_probability_factor(n_hulls) == times
