import re

import numpy as np

from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.learning.model_card import model_card


def test_the_shipped_card_is_that_of_the_shipped_model():
    assert (PRETRAINED / "card.md").read_text() == model_card(load_models(PRETRAINED).meta)


def test_the_card_reports_test_parts_where_there_are_some_and_validation_parts_otherwise():
    meta = load_models(PRETRAINED).meta
    on_test, on_validation = meta.metrics["test"]["gqn"]["auroc"], meta.metrics["gqn"]["auroc"]
    assert f"{on_test:.3f}" != f"{on_validation:.3f}"
    card = model_card(meta)
    assert "## On held-out test parts" in card and f"| AUROC | {on_test:.3f} |" in card
    gaps = [n * abs(said - came) for said, came, n in meta.metrics["test"]["gqn"]["reliability"]]
    share = sum(gaps) / meta.metrics["test"]["gqn"]["n"]
    assert f"| expected calibration error, ten bins | {share:.1%} |  |" in card
    without = {name: value for name, value in meta.metrics.items() if name not in ("test", "new_sizes")}
    card = model_card(meta.model_copy(update={"metrics": without}))
    assert "## On held-out validation parts" in card and f"| AUROC | {on_validation:.3f} |" in card


def test_an_interval_that_is_not_known_is_left_out():
    meta = load_models(PRETRAINED).meta
    quality = meta.metrics["test"]["gqn"]
    for unknown in (np.nan, None):
        gqn = quality | {"intervals": {name: [unknown, unknown] for name in quality["intervals"]}}
        card = model_card(meta.model_copy(update={"metrics": meta.metrics["test"] | {"gqn": gqn}}))
        assert f"| AUROC | {quality['auroc']:.3f} |  |" in card


def test_tables_are_well_formed_with_and_without_variances():
    meta = load_models(PRETRAINED).meta
    metrics = meta.metrics["test"]
    mean_only = {name: v for name, v in metrics["gdn"].items() if name not in ("axes", "least_uncertain")}
    for gdn, n_tables in ((metrics["gdn"], 3), (mean_only, 2)):
        card = model_card(meta.model_copy(update={"metrics": {"gqn": metrics["gqn"], "gdn": gdn}}))
        tables = re.findall(r"(?:^\|.*\n)+", card, flags=re.MULTILINE)
        assert len(tables) == n_tables
        for table in tables:
            assert len({line.count("|") for line in table.splitlines()}) == 1
