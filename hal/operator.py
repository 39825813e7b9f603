"""The person at a real cell: lays parts down, looks at a plan, says whether the arm may move."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TextIO

from hal import Cell
from mskgrasp.core.errors import MskgraspError, UsageError


class StoppedByOperator(MskgraspError):
    """The operator ended the run, or is no longer there to be asked."""

    exit_code = 130


class Operator:
    """Asks before a real arm moves, and stands in for the feeder that a real cell has not.

    A simulated cell is never held up by questions, and neither is any cell with ``yes``.

    Args:
        cell: Connected or not.
        yes: Ask nothing: parts are taken to lie there, the arm moves as soon as a grasp is planned.
        answers: Where answers are read, a line each; standard input by default.
        prompts: Where questions go; standard error by default, so that it may be told from results.

    Attributes:
        asks: Whether anybody is asked.

    Raises:
        UsageError: Somebody must be asked, and standard input is no terminal.
    """

    def __init__(
        self, cell: Cell, *, yes: bool = False, answers: TextIO | None = None, prompts: TextIO | None = None
    ):
        self.asks = not (yes or cell.arm.simulated)
        if self.asks and answers is None and not sys.stdin.isatty():
            raise UsageError(
                "this cell asks its operator before the arm moves, and standard input is no terminal; start "
                "it in one, or give --yes if the arm may move by itself"
            )
        self._answers = answers or sys.stdin
        self._prompts = prompts or sys.stderr

    def lay(self, cell: Cell, part: str, seed: int, *, name: str = "", keep: bool = False) -> None:
        """Has a part laid on the table, arm at home: by the cell's feeder, else by the operator.

        Args:
            cell: Connected.
            part: Name or folder.
            seed: A feeder's place and turn follow from it; an operator shakes the part's box.
            name: What is about to come, for the operator, such as "trial 3 of 20".
            keep: What was put outside the region, as on a pallet, stays there; else the table is cleared.

        Raises:
            StoppedByOperator: The operator said so.
            HalError: The cell was lost.
        """
        if cell.feeder is not None:
            settings = {"keep": True} if keep else {}
            cell.feeder.present(part, seed, **settings)
            return
        others = "leave the pallet as it is" if keep else "clear everything else away"
        self.tell(f"{name}: '{Path(part).name}'".removeprefix(": "))
        if self.asks:
            self._ask(
                f"Shake the part in its box, tip it out into the region, {others}. Enter when your hands are "
                "out of the cell, q to stop: ",
                {"": True},
            )

    def may_move(self, picture: Path, summary: str) -> bool:
        """Whether the arm may move; True without a question where nobody is asked.

        Args:
            picture: Of what is planned; written already, and opened by nobody but the operator.
            summary: The same in a line.

        Returns:
            False where the operator wants the part laid down anew.

        Raises:
            StoppedByOperator: The operator said so.
        """
        if not self.asks:
            return True
        self.tell(f"{summary}\npicture: {picture}")
        return self._ask(
            "May the arm move? y: yes, n: no, lay the part anew, q: stop: ", {"y": True, "n": False}
        )

    def recover(self, cell: Cell, reason: str) -> None:
        """Lets the arm move again after a contact; where somebody is asked, when they say so.

        Raises:
            StoppedByOperator: The operator said so; the arm stays stopped.
            HalError: It cannot be recovered.
        """
        if self.asks:
            self.tell(f"The arm stopped: {reason}")
            self._ask(
                "Look at it, clear its way. Enter to go on (it may open its fingers, moves up and home), "
                "q to stop: ",
                {"": True},
            )
        cell.arm.recover()

    def tell(self, text: str) -> None:
        """Lets the operator know."""
        print(text, file=self._prompts, flush=True)

    def _ask(self, question: str, legal: dict[str, bool]) -> bool:
        while True:
            print(question, end="", file=self._prompts, flush=True)
            line = self._answers.readline()
            word = line.strip().lower()
            if not line or word in ("q", "quit"):
                why = (
                    "stopped by the operator" if line else "nobody is there to answer (standard input ended)"
                )
                raise StoppedByOperator(f"{why}; what was finished is kept, the same command goes on")
            answer = legal.get(word if word != "yes" else "y")
            if answer is not None:
                return answer
            self.tell(f"{word!r} is no answer.")
