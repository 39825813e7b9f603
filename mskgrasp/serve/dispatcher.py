"""Queue of requests, and the processes that take them from it."""

from __future__ import annotations

import asyncio
import contextlib
import sys
import traceback
from collections import deque
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from mskgrasp.core.errors import MskgraspError
from mskgrasp.serve.planner_process import PlannerProcess, ProcessEnded
from mskgrasp.serve.rejection import Rejected, error_body

LOOK_S = 1.0
"""Time after which an idle process is looked after: it may have been killed, as by a lack of memory."""
AGAIN_S = 5.0
"""Time until a process that could not be started again is tried once more, seconds."""


@dataclass(frozen=True, eq=False)
class _Job:
    kind: str
    content_type: str
    body: bytes
    answer: asyncio.Future[tuple[int, bytes]]


class Dispatcher:
    """Distribution of requests over started processes; one that ends is started again.

    Used within one event loop: `open` first, `close` at the end. The processes belong to the caller.
    """

    def __init__(self, processes: Sequence[PlannerProcess], *, waiting: int, timeout_s: float):
        """Take processes that are ready.

        Args:
            processes: At least one.
            waiting: Requests that may wait for each process.
            timeout_s: Longest time of an answer, waiting included, seconds.
        """
        self._processes = processes
        self._most = len(processes) * (1 + waiting)
        self._timeout_s = timeout_s
        self._n_open = 0
        self._ready = set(processes)
        self._jobs: deque[_Job] = deque()
        self._offered = asyncio.Semaphore(0)
        self._threads = ThreadPoolExecutor(len(processes))
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def status(self) -> dict[str, int]:
        """Number of processes, of those that work, and of requests that are worked on or wait."""
        working = sum(process.alive for process in self._ready)
        return {"workers": len(self._processes), "working": working, "requests": self._n_open}

    def open(self) -> None:
        """Begin to distribute."""
        self._tasks = [asyncio.create_task(self._serve(process)) for process in self._processes]

    async def close(self) -> None:
        """Stop distributing; processes are killed, so that no thread waits for one or uses it later."""
        for task in self._tasks:
            task.cancel()
        for process in self._processes:
            process.kill()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._threads.shutdown()

    async def ask(self, kind: str, content_type: str, body: bytes) -> tuple[int, bytes]:
        """Have a request answered by the next free process.

        Returns:
            HTTP status and JSON.

        Raises:
            Rejected: 503, too many requests wait, or it took too long.
        """
        if self._n_open >= self._most:
            raise Rejected(503, f"{self._n_open} requests are being answered or wait; try again in a second")
        self._n_open += 1
        answer = asyncio.get_running_loop().create_future()
        job = _Job(kind, content_type, body, answer)
        self._jobs.append(job)
        self._offered.release()
        try:
            return await asyncio.wait_for(answer, self._timeout_s)
        except TimeoutError as error:
            raise Rejected(503, f"no answer within {self._timeout_s:g} s; try again later") from error
        finally:
            self._n_open -= 1
            # Bodies of megabytes do not pile up while no process can be started.
            if job in self._jobs:
                self._jobs.remove(job)

    async def _serve(self, process: PlannerProcess) -> None:
        loop = asyncio.get_running_loop()
        while True:
            offered = False
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(LOOK_S):
                    offered = await self._offered.acquire()
            if not process.alive:
                if offered:  # another process may be free
                    self._offered.release()
                await self._start_again(process)
                continue
            if not offered or not self._jobs:  # the job took too long while it waited
                continue
            job = self._jobs.popleft()
            try:
                answer = await loop.run_in_executor(
                    self._threads, process.ask, job.kind, job.content_type, job.body, self._timeout_s
                )
            except ProcessEnded as error:
                _settle(job, (503, error_body(str(error))))
                await self._start_again(process)
            except Exception:  # whatever it is, the server must go on
                traceback.print_exc()
                _settle(job, (500, error_body("the server failed on this request; its log says how")))
                await self._start_again(process)
            else:
                _settle(job, answer)
            del job  # a body of megabytes is not kept until the next one comes

    async def _start_again(self, process: PlannerProcess) -> None:
        self._ready.discard(process)
        while True:
            try:
                process.start()
                await asyncio.get_running_loop().run_in_executor(self._threads, process.wait_until_ready)
                break
            except (MskgraspError, OSError) as error:
                print(f"mskgrasp.serve: {error}", file=sys.stderr, flush=True)
                await asyncio.sleep(AGAIN_S)
        self._ready.add(process)


def _settle(job: _Job, answer: tuple[int, bytes]) -> None:
    if not job.answer.done():
        job.answer.set_result(answer)
