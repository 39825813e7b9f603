"""Start of the viewer: what is shown, and the server of the page."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from mskgrasp.core.errors import UsageError
from mskgrasp.core.shipped import SIMULATED_CELL
from mskgrasp.dataset import Dataset, open_dataset
from mskgrasp.parts import Part, find_part
from mskgrasp.planning.for_cell import part_name
from mskgrasp.runtime.address import is_local
from mskgrasp.runtime.progress import note
from mskgrasp.view.config import ViewConfig


def view(config: ViewConfig) -> None:
    """Serve the page until Ctrl-C, which raises `KeyboardInterrupt`.

    Raises:
        UsageError: The extra is missing, or the address, a folder or the part cannot be used.
        MskgraspError: Part, dataset, run, model or cell cannot be used.
    """
    try:
        import viser  # noqa: F401
    except ImportError as error:
        raise UsageError("mskgrasp.view needs viser: run EXTRAS=dev,view .ci/setup") from error
    from mskgrasp.trials.engine import connected_engine
    from mskgrasp.view.cell_panel import CellPanel
    from mskgrasp.view.dataset_panel import DatasetPanel
    from mskgrasp.view.page import Page
    from mskgrasp.view.page_server import PageServer, require_local
    from mskgrasp.view.part_panel import PartPanel
    from mskgrasp.view.run_panel import RunPanel
    from mskgrasp.view.stored_run import read_run

    require_local(config.host, allow_remote=config.allow_remote)
    part = None if config.part is None else find_part(part_name(config.part, config.unit))
    if part is None and config.planner.policy == "certified":
        raise UsageError("--planner.policy certified needs the part on the table: --part NAME")
    dataset = None if config.data is None else open_dataset(config.data)
    trials = None if config.run is None else read_run(config.run)
    cell = cell_file(config)
    with ExitStack() as stack:
        server = PageServer(config.host, config.port, "mskgrasp")
        stack.callback(server.stop)
        page = Page(server)
        if part is not None:
            PartPanel(page, part)
        if dataset is not None:
            panel = DatasetPanel(page, dataset, first_part(dataset, part))
            stack.callback(panel.simulator.close)
        if config.run is not None and trials is not None:
            RunPanel(page, config.run, trials)
        if cell is not None:
            # The page asks before a motion, in place of an operator at the terminal.
            connected = connected_engine(cell, yes=True, picture=Path("next.png"), tape=None)
            CellPanel(page, stack.enter_context(connected), config, part)
        page.begin()
        print(start_text(config, server.get_port(), cell), flush=True)
        if not is_local(config.host):
            may = ", and move the arm" if config.allow_motion and cell is not None else ""
            note(f"warning: whoever reaches {config.host} can use this page{may}")
        page.main.run()


def cell_file(config: ViewConfig) -> Path | None:
    """File of the cell to plan on; None where a dataset or a run is shown, and no cell was named."""
    if config.cell is not None:
        return config.cell
    return SIMULATED_CELL if config.data is None and config.run is None else None


def first_part(dataset: Dataset, part: Part | None) -> str | None:
    """Name of the part whose attempts are shown first; None: any.

    Raises:
        UsageError: The dataset has no attempts at the given part.
    """
    if part is None or part.name in dataset.part_names:
        return None if part is None else part.name
    raise UsageError(
        f"{dataset.folder} has no attempts at part '{part.name}'; omit --part, or take one of "
        f"{', '.join(dataset.part_names[:5])}, ..."
    )


def start_text(config: ViewConfig, port: int, cell: Path | None) -> str:
    """The line that is printed when the page can be opened."""
    host = f"[{config.host}]" if ":" in config.host else config.host
    what = [
        None if config.part is None else f"part {config.part}",
        None if config.data is None else f"dataset {config.data}",
        None if config.run is None else f"run {config.run}",
        None if cell is None else f"cell {cell.name}",
    ]
    return f"http://{host}:{port}: {', '.join(one for one in what if one)}; Ctrl-C stops"
