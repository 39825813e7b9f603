"""manifold3d held to one thread."""

from __future__ import annotations

import os
from functools import cache

from manifold3d import Manifold


@cache
def hold_manifold_to_one_thread() -> None:
    """Make manifold3d compute in the thread that calls it, if this process has not used it before.

    Its thread pool has one thread for each core. Bodies of parts are too small to be shared out: the others
    wait for work by spinning, on two cores a quarter of an import's processor time, which a worker process
    beside this one needs. The pool has no other setting than the cores on which its first user may run.
    """
    if not hasattr(os, "sched_setaffinity"):  # Linux alone has it
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        body = Manifold.sphere(1.0, 100)  # one of few faces would not begin the pool
        (body - body.translate((0.5, 0.0, 0.0))).volume()
    finally:
        os.sched_setaffinity(0, cores)
