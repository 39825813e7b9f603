"""The renderer against what a viewer sees of boxes."""

import numpy as np
import trimesh

from mskgrasp.parts.figures.render import Body, render

RED, BLUE = (0.9, 0.1, 0.1), (0.1, 0.1, 0.9)


def box(edge: float, at: tuple[float, float, float], colour: tuple[float, float, float]) -> Body:
    mesh = trimesh.creation.box((edge, edge, edge))
    mesh.apply_translation(at)
    return Body(mesh=mesh, colour=colour)


def shares(picture: np.ndarray) -> tuple[float, float, float]:
    """Shares of the pixels that are white, red and blue."""
    red, blue = picture[..., 0] > 1.5 * picture[..., 2], picture[..., 2] > 1.5 * picture[..., 0]
    return float((picture.min(axis=2) > 0.99).mean()), float(red.mean()), float(blue.mean())


def test_a_body_fills_the_frame_before_white():
    picture = render([box(10, (0, 0, 0), RED)], width=120, height=90, table=False)
    assert picture.shape == (90, 120, 3) and 0 <= picture.min() and picture.max() <= 1
    rows, columns = np.nonzero(picture.min(axis=2) < 0.9)
    assert max(np.ptp(rows) / 90, np.ptp(columns) / 120) > 0.8
    assert np.array_equal(picture[0, 0], [1, 1, 1])


def test_the_nearer_of_two_bodies_hides_the_other_in_either_order():
    far, near = box(10, (0, 10, 0), RED), box(10, (0, -10, 0), BLUE)
    view = {"width": 120, "height": 90, "table": False, "azimuth": -90, "elevation": 0}
    for bodies in ([far, near], [near, far]):
        _, red, blue = shares(render(bodies, **view))
        assert red < 0.005 and blue > 0.3


def test_a_table_is_darker_in_the_shadow():
    body = box(10, (0, 0, 5), BLUE)
    plain = render([body], width=120, height=90, table=False)
    table = render([body], width=120, height=90, table=True)
    assert shares(table)[0] < shares(plain)[0]
    grey = (np.ptp(table, axis=2) < 0.05) & (table.mean(axis=2) < 0.75)
    assert grey.mean() > 0.005
