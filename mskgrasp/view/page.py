"""The page: its panels, of which one is shown, and what it says."""

from __future__ import annotations

import re
from typing import Any

from viser import FrameHandle, GuiButtonHandle, GuiEvent, GuiFolderHandle, GuiInputHandle

from mskgrasp.core.errors import MskgraspError
from mskgrasp.core.settings import REGION
from mskgrasp.runtime.progress import note
from mskgrasp.view.main_thread import MainThread, Work
from mskgrasp.view.page_server import PageServer


class Page:
    """The page of a server.

    Args:
        server: The server; the page fills it.

    Attributes:
        scene: The 3-D scene, base frame, metres.
        gui: The controls.
        main: Does the work of the callbacks.
    """

    def __init__(self, server: PageServer):
        self.server = server
        self.scene, self.gui = server.scene, server.gui
        self.main = MainThread(self.fail)
        self.panels: dict[str, Panel] = {}
        self._choice = self.gui.add_folder("show")
        self._status = self.gui.add_markdown("")
        x_min, x_max, y_min, y_max = REGION
        x, y = (x_min + x_max) / 2, (y_min + y_max) / 2
        # Shadows would double the work of a browser without a GPU.
        self.scene.configure_default_lights(cast_shadow=False)
        self.scene.add_grid(
            "/table", 1.0, 1.4, position=(x, y, -1e-3), cell_size=0.01, section_size=0.05, cell_thickness=0.5,
            cell_color=(236, 237, 239), section_color=(214, 216, 220), shadow_opacity=0.0,
        )  # fmt: skip
        server.initial_camera.position = (x + 0.17, y - 0.16, 0.17)
        server.initial_camera.look_at = (x, y, 0.01)

    def tell(self, text: str) -> None:
        """Show Markdown under the panel, in place of the last; what is not its own text is `plain`."""
        self._status.content = text

    @property
    def said(self) -> str:
        """What it says now."""
        return self._status.content

    def fail(self, error: MskgraspError) -> None:
        """Show an error on the page, and print it."""
        note(f"mskgrasp.view: {error}")
        self.tell(f"**{type(error).__name__}**: {plain(error)}")

    def show(self, name: str) -> None:
        """Show one panel with what it has drawn, and hide the others."""
        for own, panel in self.panels.items():
            panel.folder.visible = panel.root.visible = own == name
        self.tell("")
        self.panels[name].shown()

    def begin(self) -> None:
        """Offer the panels and show the first one."""
        names = list(self.panels)
        if len(names) > 1:
            with self._choice:
                choice = self.gui.add_button_group("", names)
            choice.on_click(lambda _: self.main.submit("show", lambda: self.show(choice.value)))
        else:
            self._choice.remove()
        try:
            self.show(names[0])
        except MskgraspError as error:  # the other panels can be opened
            self.fail(error)


class Panel:
    """A panel of controls and the nodes that belong to it.

    Args:
        page: The page.
        name: Of the panel, in a word.

    Attributes:
        root: Parent of its nodes, at the base; hidden with the panel.
        folder: Its controls.
    """

    def __init__(self, page: Page, name: str):
        self.page = page
        self.root: FrameHandle = page.scene.add_frame(f"/{name}", show_axes=False)
        self.folder: GuiFolderHandle = page.gui.add_folder(name)
        page.panels[name] = self

    def shown(self) -> None:
        """Called when the panel becomes the one that is shown."""

    def on(self, control: GuiInputHandle[Any] | GuiButtonHandle, work: Work) -> None:
        """Have work done by the main thread when the user changes or presses a control."""
        name = f"{self.root.name} {control.label}"

        def act(_: GuiEvent) -> None:
            self.page.main.submit(name, work)

        if isinstance(control, GuiButtonHandle):
            control.on_click(act)
        else:
            control.on_update(act)


def plain(text: object) -> str:
    """Text of a file or an error for Markdown: shown as it is.

    The page renders tags in Markdown as they stand, and a script there could press its buttons.
    """
    return re.sub(r"[&<>\\`*_\[\]|~#!$]", lambda sign: f"&#{ord(sign[0])};", str(text))
