"""Versions of what makes simulated data."""

from mskgrasp.simulation.versions import SIMULATION_VERSION, other_versions, versions


def test_data_made_before_versions_were_numbered_are_of_version_1():
    unnumbered = versions() | {"simulation": "38dc7f58aea7bdfa"}
    assert other_versions(unnumbered) == f"simulation 1 (here {SIMULATION_VERSION})"
    assert "simulation 38dc" in other_versions(unnumbered | {"simulation": "38dc7f58aea7bdff"})
    assert other_versions(versions()) == ""
