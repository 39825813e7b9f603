"""Dialogue with the operator of a real cell: placing parts, confirming motions, recovering."""

from __future__ import annotations

import contextlib
import math
import sys
import termios
from pathlib import Path
from typing import TextIO

from hal import Cell
from mskgrasp.core.errors import MskgraspError, UsageError


class StoppedByOperator(MskgraspError):
    """The operator ended the run, or standard input ended."""

    exit_code = 130


class Operator:
    """Operator, who is asked before a real arm moves, and for parts on a cell without a feeder.

    Nothing is asked on a simulated cell, nor on any cell with ``yes``.

    Args:
        cell: Connected or not.
        yes: Ask nothing: parts are assumed to be in place, the arm moves as soon as a grasp is planned.
        answers: Stream of answers, a line each; standard input by default.
        prompts: Stream of questions; standard error by default, apart from results.

    Attributes:
        asks: Whether the operator is asked.

    Raises:
        UsageError: An operator must be asked, and standard input is no terminal.
    """

    def __init__(
        self, cell: Cell, *, yes: bool = False, answers: TextIO | None = None, prompts: TextIO | None = None
    ):
        self.asks = not (yes or cell.arm.simulated)
        # It is None where the program was started with it closed.
        if self.asks and answers is None and (sys.stdin is None or not sys.stdin.isatty()):
            raise UsageError(
                "this cell asks its operator before the arm moves, and standard input is no terminal; start "
                "it in one, or where the program has --yes give it if the arm may move by itself"
            )
        self._answers = answers or sys.stdin
        self._prompts = prompts or sys.stderr

    def present(self, cell: Cell, part: str, seed: int, *, name: str = "", keep: bool = False) -> None:
        """Have a part placed on the table, arm at home: by the cell's feeder, else by the operator.

        Args:
            cell: Connected.
            part: Name or folder.
            seed: Determines a feeder's position and turn; an operator shakes the part's box.
            name: Title for the operator, such as "trial 3 of 20".
            keep: Parts outside the region, such as on a pallet, stay; else the table is cleared.

        Raises:
            StoppedByOperator: The operator ended the run.
            HalError: The cell was lost.
        """
        if cell.feeder is not None:
            settings = {"keep": True} if keep else {}
            cell.feeder.present(part, seed, **settings)
            return
        others = "leave the pallet as it is" if keep else "clear everything else away"
        self.inform(f"{name}: '{Path(part).name}'".removeprefix(": "))
        self.wait_for(
            f"Shake the part in its box, tip it out into the region, {others}. Enter when your hands are "
            "out of the cell, q to stop: "
        )

    def may_move(self, picture: Path, summary: str) -> bool:
        """Whether the arm may move; True without a question if no operator is asked.

        Args:
            picture: File that shows the plan, for the operator to open.
            summary: The plan in a line.

        Returns:
            False if the operator wants to place the part again.

        Raises:
            StoppedByOperator: The operator ended the run.
        """
        if not self.asks:
            return True
        self.inform(f"{summary}\npicture: {picture}")
        return self._ask(
            "May the arm move? y: yes, n: no, place the part again, q: stop: ", {"y": True, "n": False}
        )

    def confirm(self, question: str) -> bool:
        """The operator's answer to a question, yes or no; True without a question if no operator is asked.

        Raises:
            StoppedByOperator: The operator ended the run.
        """
        return not self.asks or self._ask(question, {"y": True, "n": False})

    def wait_for(self, request: str) -> None:
        """Wait until the operator has done something and presses Enter; not at all if no operator is asked.

        Raises:
            StoppedByOperator: The operator ended the run.
        """
        if self.asks:
            self._ask(request, {"": True})

    def take(self) -> bool:
        """Have the operator hold what the hand holds, before the fingers open.

        Returns:
            Whether an operator was asked.

        Raises:
            StoppedByOperator: The operator ended the run; the fingers stay closed.
        """
        self.wait_for(
            "The hand holds something. Take hold of it; Enter: the fingers open and the arm moves home, "
            "q to stop: "
        )
        return self.asks

    def number(self, question: str, lower: float, upper: float) -> float:
        """A number that the operator reads off an instrument, within bounds; asks again until it is one.

        Raises:
            StoppedByOperator: The operator ended the run.
        """
        while True:
            line = self._line(question)
            try:
                value = float(line.replace(",", "."))
            except ValueError:
                value = math.nan
            if lower <= value <= upper:
                return value
            self.inform(f"{line!r} is no number from {lower:g} to {upper:g}.")

    def recover(
        self, cell: Cell, reason: str, *, then: str = "it may open its fingers, moves up and home"
    ) -> None:
        """Recover the arm after a contact, once the operator confirms.

        Args:
            cell: Connected.
            reason: Why the arm stopped.
            then: What moves next, for the operator.

        Raises:
            StoppedByOperator: The operator ended the run; the arm stays stopped.
            HalError: The arm cannot be recovered.
        """
        if self.asks:
            self.inform(f"The arm stopped: {reason}")
            self.wait_for(f"Check it and remove obstacles. Enter to continue ({then}), q to stop: ")
        cell.arm.recover()

    def inform(self, text: str) -> None:
        """Print a line for the operator."""
        print(text, file=self._prompts, flush=True)

    def _ask(self, question: str, legal: dict[str, bool]) -> bool:
        while True:
            word = self._line(question)
            answer = legal.get({"yes": "y", "no": "n"}.get(word, word))
            if answer is not None:
                return answer
            self.inform(f"{word!r} is no valid answer.")

    def _line(self, question: str) -> str:
        forget_typed(self._answers)
        print(question, end="", file=self._prompts, flush=True)
        line = self._answers.readline()
        word = line.strip().lower()
        if not line or word in ("q", "quit"):
            why = "stopped by the operator" if line else "no answer (standard input ended)"
            raise StoppedByOperator(f"{why}; what was finished is kept, the same command goes on")
        return word


def forget_typed(answers: TextIO) -> None:
    """Drop what was typed into a terminal before a question: it answers another one, or none."""
    if answers.isatty():
        with contextlib.suppress(termios.error, OSError):  # it is gone, which the answer will tell
            termios.tcflush(answers, termios.TCIFLUSH)
