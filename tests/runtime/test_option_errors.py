"""Arguments that cannot be parsed: one line with what is legal."""

from __future__ import annotations

import pytest

from mskgrasp.core.errors import UsageError
from mskgrasp.runtime.options import parse_command
from tests.runtime.small_program import COMMANDS, parse_program

HELP = "; program --help lists what is legal"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--camera.n-pixels", "many"], "--camera.n-pixels needs INT, got many"),
        (["--camera.n_pixels=many"], "--camera.n-pixels needs INT, got many"),
        (["--camera.pixels", "64"], "unknown option --camera.pixels; similar: --camera.n-pixels"),
        (["--confg", "a.yaml"], "unknown option --confg; similar: --config"),
        (["--zzz"], "unknown option --zzz"),
        (["--low"], "--low needs FLOAT"),
        (["--low", "1", "2"], "unexpected argument '2'"),
        (["--kind", "orange"], "--kind: 'orange' is not legal; legal: apple, pear"),
    ],
)
def test_an_argument_that_cannot_be_parsed_is_one_line_with_what_is_legal(arguments, message, capsys):
    with pytest.raises(UsageError) as caught:
        parse_program(*arguments)
    assert str(caught.value) == message + HELP
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "a command is missing; legal: eat, drink, pay" + HELP),
        (["drnk"], "unknown command 'drnk'; legal: eat, drink, pay"),
        (["eat"], "missing: fruit (STR)" + HELP),
        (["eat", "pear", "--peaces", "2"], "unknown option --peaces; similar: --n-pieces" + HELP),
        (["pay", "--amont", "2"], "unknown option --amont; similar: --amount" + HELP),
        (["pay"], "missing: --amount (FLOAT)" + HELP),
        (["drink", "water"], "unexpected argument 'water'" + HELP),
        (["eat", "pear", "--n-pieces"], "--n-pieces needs INT; program eat --help lists what is legal"),
    ],
)
def test_a_wrong_command_is_one_line_with_what_is_legal(arguments, message, capsys):
    with pytest.raises(UsageError) as caught:
        parse_command(COMMANDS, prog="program", description="Does.", argv=arguments)
    assert str(caught.value) == message
    assert capsys.readouterr() == ("", "")
