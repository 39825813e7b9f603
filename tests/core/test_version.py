"""The version is that of the installed package."""

from __future__ import annotations

import importlib.metadata

from mskgrasp.core.version import __version__


def test_the_version_is_that_of_the_installed_package():
    assert importlib.metadata.version("mskgrasp") == __version__
