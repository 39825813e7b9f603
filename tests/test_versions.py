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
