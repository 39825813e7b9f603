from mskgrasp.parts.builtin import builtin_names, recipe_hash
from mskgrasp.simulation.versions import other_versions, versions
from tests.versions import changed, code_digest


def test_code_that_decides_outcomes_changes_only_together_with_its_version():
    assert not changed(), (
        "if outcomes differ, raise the version; then, or if they are the same to the last bit, "
        "run python -m tests.versions --store"
    )


def test_comments_docstrings_and_imports_are_no_change_but_numbers_are():
    before = 'import math\n\n\ndef area(r):\n    """Of a circle."""\n    return math.pi * r**2\n'
    worded = "import math as m\nimport math\n\n\ndef area(r):\n    # exact\n    return math.pi * r**2\n"
    assert code_digest(before) == code_digest(worded)
    assert code_digest(before) != code_digest(before.replace("**2", "**3"))


def test_data_made_before_versions_were_numbered_are_of_version_1():
    first = versions() | {"simulation": "38dc7f58aea7bdfa"}
    assert other_versions(first) == ""
    assert "simulation 38dc" in other_versions(first | {"simulation": "38dc7f58aea7bdff"})


def test_parts_made_before_versions_were_numbered_are_current():
    # Read from part.json files written then.
    made = {
        "bearing_6202": "b89b85b0b7ddacce9f8318cc9fdf7aaf50ad6c744c521d2630a6392a9fcc20be",
        "hex_nut_m30": "b9db09476e127f47e8ec7795ec87d0d0c6e6e1f2c29e481eff78bea91dd852f7",
        "l_bracket_40x40": "9a0c6a1beefdce99e373e245ce701407f585fb3b8b0367b21527c0362017ffd7",
        "pillow_block_80x32": "abdf023b8e59f20cceb318d1d57c7de15127628a294293a569272ba1e43c1e92",
        "spur_gear_m2_z18": "af95c084338c8e9eb27b2386d9ed610b2c17107b499955f523a7cdcf2241d657",
    }
    assert {name: recipe_hash(name) for name in made if name in builtin_names()} == {
        name: digest for name, digest in made.items() if name in builtin_names()
    }
