"""The JSON of refusals."""

from __future__ import annotations

import json

from mskgrasp.serve.rejection import Rejected, error_body


def test_a_refusal_is_one_line_of_limited_length():
    assert json.loads(error_body("no\n such  path; try another")) == {"error": "no such path; try another"}
    assert len(json.loads(error_body("x" * 10_000))["error"]) < 510


def test_a_refusal_holds_its_status():
    error = Rejected(413, "too large; send less")
    assert (error.status, str(error)) == (413, "too large; send less")
