"""Program ``python -m mskgrasp.serve``."""

from __future__ import annotations

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred

DESCRIPTION = """Answers requests for grasps over HTTP.

POST /plan, /score and /place, GET /health, /models and /openapi.json: plans in clients' depth images,
scores their grasps, computes where to place. It moves no arm and reads no path from a request. Only this
machine can connect; another address needs --token-file. Needs the extra [serve]. docs/serve.md describes the
requests; examples/serve_client.py is a client.

python -m mskgrasp.serve --port 8093

For other machines: python -m mskgrasp.serve --host 0.0.0.0 --token-file token"""


def main() -> int:
    """Parse, start, serve until Ctrl-C."""
    with ctrl_c_deferred():
        from mskgrasp.runtime.options import parse
        from mskgrasp.serve.config import ServeConfig
    config = parse(ServeConfig, prog="python -m mskgrasp.serve", description=DESCRIPTION)
    with ctrl_c_deferred():  # not for a mistyped option
        from mskgrasp.serve.run import serve
    serve(config)
    return 0


if __name__ == "__main__":
    run("mskgrasp.serve", main)
