"""Points that share an indentation table."""

from palpate.solid.options import first_images

GRID = {
    "01": {"position_m": [-0.1, -0.05, 0.04]},
    "02": {"position_m": [0.1, -0.05, 0.04]},
    "03": {"position_m": [0.1, 0.05, 0.04]},
    "04": {"position_m": [0.0, 0.05, 0.04]},
}
SUPPORT = {"plane_point_m": [0, 0, 0]}


def test_without_mirrors_each_point_is_its_own():
    assert first_images({"points": GRID, "support": SUPPORT}) == {n: (n, []) for n in GRID}


def test_images_in_one_and_two_mirrors():
    spec = {"points": GRID, "support": SUPPORT, "mirrors": [[2, 0, 0], [0, 1, 0]]}
    assert first_images(spec) == {
        "01": ("01", []),
        "02": ("01", [0]),
        "03": ("01", [0, 1]),
        "04": ("04", []),
    }


def test_mirrors_lie_where_the_support_says():
    spec = {"points": GRID, "support": {"plane_point_m": [0.05, 0, 0]}, "mirrors": [[1, 0, 0]]}
    assert first_images(spec)["02"] == ("02", [])


def test_a_press_of_its_own_direction_has_no_images():
    slanted = GRID | {"02": GRID["02"] | {"direction": [0.1, 0, -1]}}
    spec = {"points": slanted, "support": SUPPORT, "mirrors": [[1, 0, 0]]}
    assert first_images(spec)["02"] == ("02", [])
