"""Versions of what makes simulated data."""

from mskgrasp.simulation.versions import SIMULATION_VERSION, other_versions, versions


def test_data_made_before_versions_were_numbered_are_of_version_1():
    unnumbered = versions() | {"simulation": "38dc7f58aea7bdfa"}
    assert other_versions(unnumbered) == f"simulation 1 (here {SIMULATION_VERSION})"
    assert "simulation 38dc" in other_versions(unnumbered | {"simulation": "38dc7f58aea7bdff"})
    assert other_versions(versions()) == ""


def test_versions_name_what_makes_the_data_and_are_text():
    found = versions()
    assert {"sapien", "mani_skill", "torch", "numpy", "mskgrasp", "simulation", "python"} == set(found)
    assert all(isinstance(version, str) and version[0].isdigit() for version in found.values())
    assert found["simulation"] == str(SIMULATION_VERSION)


def test_what_differs_is_named_with_both_versions_and_what_is_not_recorded_is_unknown():
    own = versions()
    other = {name: version for name, version in own.items() if name != "torch"} | {"numpy": "1.0"}
    said = other_versions(other)
    assert f"numpy 1.0 (here {own['numpy']})" in said and f"torch unknown (here {own['torch']})" in said
    assert "sapien" not in said and said.count(", ") == 1
    assert other_versions(own | {"mujoco": "3"}) == ""  # of more than makes the data
