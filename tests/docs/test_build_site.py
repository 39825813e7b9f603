"""The check of the built site, on one that is small enough to know its faults."""

from __future__ import annotations

import time
from pathlib import Path

from tests.browser import Page
from tests.docs.build_site import SEARCH, faults, use_own_search

GOOD = """<html><head><link rel="canonical" href="https://site.example/"><link rel="stylesheet" href="a.css">
</head><body><h1 id="top">A</h1><a href="#top">up</a> <a href="sub/">sub</a> <a href="https://elsewhere.example">out</a>
</body></html>"""


def site(folder: Path, body: str = "") -> Path:
    (folder / "sub").mkdir()
    (folder / "a.css").write_text("")
    (folder / "index.html").write_text(GOOD.replace("</body>", body + "</body>"))
    (folder / "sub" / "index.html").write_text('<h1 id="b">B</h1> <a href="../index.html#top">A</a>')
    return folder


def test_a_site_whose_links_lead_somewhere_has_no_faults(tmp_path: Path):
    assert faults(site(tmp_path)) == []


def test_broken_links_and_files_of_other_servers_are_named(tmp_path: Path):
    body = (
        '<a href="gone.html">x</a> <a href="sub/index.html#c">y</a> <img src="gone.png">'
        '<script src="https://cdn.example/x.js"></script>'
    )
    assert sorted(faults(site(tmp_path, body))) == [
        "index.html: loads https://cdn.example/x.js",
        "index.html: no file gone.html",
        "index.html: no file gone.png",
        "index.html: no heading sub/index.html#c",
    ]


def test_a_page_opened_from_the_disk_has_a_worker(tmp_path: Path):
    """Which answers what it was asked before it was loaded."""
    (tmp_path / "assets" / "javascripts").mkdir(parents=True)
    (tmp_path / "double.js").write_text("self.onmessage = (asked) => self.postMessage(2 * asked.data);")
    (tmp_path / "index.html").write_text(
        '<body><script src="https://unpkg.com/iframe-worker/shim"></script></body>'
    )
    use_own_search(tmp_path)
    assert (tmp_path / "assets" / "javascripts" / SEARCH.name).is_file() and faults(tmp_path) == []
    with Page(tmp_path / "index.html") as page:
        page.evaluate(
            "worker = new Worker('double.js'); worker.onmessage = (got) => { answer = got.data; };"
            "worker.postMessage(21)"
        )
        deadline = time.monotonic() + 20
        while (answer := page.evaluate("globalThis.answer")) is None and time.monotonic() < deadline:
            time.sleep(0.05)
        page.evaluate("worker.terminate()")
        assert answer == 42 and page.evaluate("document.querySelectorAll('iframe').length") == 0
