import sys
from types import ModuleType

import pytest

from mskgrasp.core.lazy_names import lazy_names


@pytest.fixture
def package(monkeypatch):
    made = ModuleType("made_package")
    monkeypatch.setitem(sys.modules, made.__name__, made)
    made.__getattr__, made.__dir__ = lazy_names(made.__name__, {"fractions": ("Fraction",)})
    return made


def test_a_name_is_that_of_its_module_and_found_without_a_call_the_second_time(package):
    from fractions import Fraction

    assert "Fraction" not in vars(package)
    assert package.Fraction is Fraction and vars(package)["Fraction"] is Fraction


def test_names_are_listed_before_they_are_imported(package):
    assert "Fraction" in dir(package) and "Fraction" not in vars(package)


def test_a_name_that_does_not_exist_is_an_attribute_error(package):
    with pytest.raises(AttributeError, match="module 'made_package' has no attribute 'Fractoin'"):
        _ = package.Fractoin
