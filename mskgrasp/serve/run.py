"""Start and end of the server: address, token, processes."""

from __future__ import annotations

import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from hal.cell import Workspace
from hal.config import SimulatedCellConfig
from mskgrasp.core.errors import UsageError
from mskgrasp.core.grasp import HAND_GEOMETRY
from mskgrasp.core.settings import TABLE_Z
from mskgrasp.core.version import __version__
from mskgrasp.learning.grasp_models import DESCRIPTION, read_meta, require_hand, require_model
from mskgrasp.planning.run_inputs import model_digests
from mskgrasp.runtime.address import is_local, listening
from mskgrasp.runtime.progress import note
from mskgrasp.runtime.worker_pool import process_count
from mskgrasp.serve.config import ServeConfig
from mskgrasp.serve.dispatcher import Dispatcher
from mskgrasp.serve.guard import Guard
from mskgrasp.serve.planner_process import PlannerProcess, PlannerSettings

LEAST_TOKEN = 16
"""Fewest characters of a token."""
MOST_CONNECTIONS = 1000
"""Connections at once, idle ones included; one more is closed."""
LAST_ANSWERS_S = 3
"""Time for open requests after Ctrl-C, seconds."""


def serve(config: ServeConfig) -> None:
    """Serve until Ctrl-C, which raises `KeyboardInterrupt`, or a request to terminate, which exits with 0.

    Raises:
        UsageError: The extra is missing, an address needs a token, the address is taken, or the model, the
            cell's file or the token's is missing.
        MskgraspError: The model or the cell cannot be used.
    """
    try:
        import fastapi  # noqa: F401
        import uvicorn
    except ImportError as error:
        raise UsageError(
            "mskgrasp.serve needs FastAPI and uvicorn: run EXTRAS=dev,serve .ci/setup"
        ) from error
    from mskgrasp.serve.app import make_app
    from mskgrasp.serve.connections import closing_after

    token = read_token(config)
    settings = planner_settings(config)
    n = process_count(config.workers)
    processes = [PlannerProcess(settings) for _ in range(n)]
    with listening(config.host, config.port) as listener, ended_by_sigterm():
        try:
            for process in processes:
                process.start()
            for process in processes:
                process.wait_until_ready()
            _listen(listener)
            dispatcher = Dispatcher(processes, waiting=config.queue, timeout_s=config.timeout_s)
            app = make_app(
                dispatcher,
                about_models(config.models, settings),
                lowest_grasp_z=settings.workspace.lowest_grasp_z,
                max_body=int(1e6 * config.max_body_mb),
                timeout_s=config.timeout_s,
            )
            # Beyond those that plan or wait: some that are being received, and what needs no process.
            guard = Guard(app, token=token, most=n * (1 + config.queue) + 16)
            host, port = listener.getsockname()[:2]
            shown = f"[{host}]" if ":" in host else host
            print(f"http://{shown}:{port}: {n} workers, model {config.models.name}; Ctrl-C stops", flush=True)
            settings_of_uvicorn = uvicorn.Config(
                guard,  # pyright: ignore[reportArgumentType]
                http=closing_after(config.timeout_s, most=MOST_CONNECTIONS),
                loop="asyncio", ws="none", lifespan="on", log_config=None, access_log=False,
                proxy_headers=False, server_header=False, timeout_graceful_shutdown=LAST_ANSWERS_S,
            )  # fmt: skip
            uvicorn.Server(settings_of_uvicorn).run(sockets=[listener])
        finally:
            for process in processes:
                process.stop()


@contextmanager
def ended_by_sigterm() -> Iterator[None]:
    """Make a request to terminate raise `SystemExit` in the block, so that what was started is ended."""
    before = signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def read_token(config: ServeConfig) -> str | None:
    """Read the token that clients have to send; None: this machine alone can connect, and needs none.

    Raises:
        UsageError: The address needs a token and there is none, or the file cannot be used.
    """
    if config.token_file is None:
        if not is_local(config.host):
            raise UsageError(
                f"--host {config.host} can be reached from other machines and needs --token-file FILE with a "
                "token that clients send; or listen on 127.0.0.1"
            )
        return None
    try:
        token = config.token_file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not ASCII"
        raise UsageError(f"--token-file {config.token_file}: {reason}; write one word into it") from error
    if len(token) < LEAST_TOKEN or not token.isprintable() or " " in token:
        raise UsageError(
            f"--token-file {config.token_file}: the token must be one word of {LEAST_TOKEN} characters or "
            "more; make one with: python -c 'import secrets; print(secrets.token_urlsafe())'"
        )
    if config.token_file.stat().st_mode & 0o077:
        note(f"warning: others may read {config.token_file}; run: chmod 600 {config.token_file}")
    return token


def planner_settings(config: ServeConfig) -> PlannerSettings:
    """Settings of the processes: the model, and the table of the cell.

    Raises:
        BadConfig: The cell's file is missing or not valid.
        MissingModel: There is no model in the folder.
        BadModel: Its description is damaged, or it was made for another hand than the cell's.
    """
    require_model(config.models)
    hand, workspace = HAND_GEOMETRY, simulated_table()
    if config.cell is not None:
        from hal.open_cell import cell_from_yaml  # only here: it may load a simulator

        cell = cell_from_yaml(config.cell)
        hand, workspace = cell.arm.limits.gripper.geometry, cell.workspace
    require_hand(read_meta(config.models / DESCRIPTION), hand, config.models)
    return PlannerSettings(
        models=config.models.absolute(),
        config=config.planner.for_motion(),
        workspace=workspace,
    )


def simulated_table() -> Workspace:
    """Table of the simulated cell, without the simulator."""
    cell = SimulatedCellConfig()
    return Workspace(
        table_z=TABLE_Z,
        region=cell.region,
        home=np.array(cell.home),
        min_height=cell.noise.least_height,
        lift_height=cell.lift_height,
        grasp_force=cell.grasp_force,
        clearance=cell.clearance,
    )


def about_models(folder: Path, settings: PlannerSettings) -> dict[str, Any]:
    """Answer to /models: names and digests, no path of this machine."""
    meta = read_meta(folder / DESCRIPTION)
    table = settings.workspace
    return {
        "version": __version__,
        "models": [
            {
                "name": folder.name,
                "digests": model_digests(folder),
                "network": meta.network.model_dump(mode="json"),
                "labels": [source.model_dump(mode="json") for source in meta.labels],
            }
        ],
        "planner": settings.config.model_dump(mode="json"),
        "table": {
            "table_z": table.table_z,
            "table_slope": list(table.table_slope),
            "region": list(table.region),
            "min_height": table.min_height,
            "clearance": table.clearance,
        },
    }


def _listen(listener: socket.socket) -> None:
    """Let clients connect.

    Raises:
        UsageError: Another program has taken the address while the workers started.
    """
    try:
        listener.listen()
    except OSError as error:
        raise UsageError(f"cannot listen: {error.strerror}; choose another --port") from error
