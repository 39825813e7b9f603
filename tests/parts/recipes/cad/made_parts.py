"""Solids of CAD recipes, for tests that need the extra [cad]."""

import importlib.util

import pytest

needs_cad = pytest.mark.skipif(importlib.util.find_spec("bd_warehouse") is None, reason="needs [cad]")


def made(listed, name):
    return listed[name].make(listed[name].dimensions)
