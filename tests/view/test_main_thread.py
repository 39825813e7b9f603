"""Work that the page's callbacks hand to the main thread."""

from __future__ import annotations

import threading
from queue import Empty

import pytest

from mskgrasp.core.errors import MskgraspError
from mskgrasp.view.main_thread import MainThread


def main_thread() -> tuple[MainThread, list[str]]:
    failures: list[str] = []
    return MainThread(lambda error: failures.append(str(error))), failures


def test_work_is_done_in_order_by_the_thread_that_runs_and_newer_work_replaces_older_of_its_name():
    main, _ = main_thread()
    done: list[tuple[str, int]] = []

    def note(what: str) -> None:
        done.append((what, threading.get_ident()))

    def ask() -> None:
        main.submit("a", lambda: note("a1"))
        main.submit("b", lambda: note("b"))
        main.submit("a", lambda: note("a2"))

    asking = threading.Thread(target=ask)
    asking.start()
    asking.join()
    main.work_once(0)
    main.work_once(0)
    assert done == [("a2", threading.get_ident()), ("b", threading.get_ident())]
    with pytest.raises(Empty):
        main.work_once(0)


def test_an_error_of_the_user_is_reported_and_work_goes_on_and_a_defect_ends_it():
    main, failures = main_thread()

    def fail(error: Exception) -> None:
        raise error

    main.submit("user", lambda: fail(MskgraspError("no part")))
    main.work_once(0)
    assert failures == ["no part"]
    main.submit("defect", lambda: fail(ZeroDivisionError()))
    with pytest.raises(ZeroDivisionError):
        main.work_once(0)


def test_repeated_work_is_done_while_nothing_else_is_asked_for_until_it_ends():
    main, _ = main_thread()
    done: list[str] = []
    main.repeat("often", lambda: done.append("often"))
    main.submit("once", lambda: done.append("once"))
    for _ in range(3):
        main.work_once()
    main.repeat("often", None)
    with pytest.raises(Empty):
        main.work_once(0)
    assert done == ["once", "often", "often"]


def test_ctrl_c_ends_the_work():
    main, _ = main_thread()

    def stop() -> None:
        raise KeyboardInterrupt

    main.submit("stop", stop)
    with pytest.raises(KeyboardInterrupt):
        main.run()
