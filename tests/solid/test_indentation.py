"""The indentation table's interpolation, its mirror image and its file."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from palpate.estimate.direct.table import force_table, sample_table
from palpate.solid.indentation_table import (
    IndentationModel,
    image_table,
    load_indentation,
    ratio_weights,
    save_indentation,
)
from palpate.solid.load_steps import POISSON_RATIOS, depth_steps, indentation_model
from palpate.solid.options import first_images, greatest_ratio
from palpate.solid.support import Support

RATIOS = np.array(POISSON_RATIOS)


def hertz(depth_m, nu):
    return 4 / 3 / (1 - nu**2) * np.sqrt(0.006) * depth_m**1.5


@pytest.fixture(scope="module")
def model():
    rng = np.random.default_rng(5)
    depth = depth_steps(0.009, 0.001)
    force = hertz(depth, RATIOS[:, None])
    move = (1 + RATIOS[:, None, None, None]) * depth[:, None, None] * rng.normal(size=(4, 3))
    return IndentationModel(
        point_m=np.array([0.01, 0.02, 0.03]),
        direction=np.array([0.0, 0.6, -0.8]),
        radius_m=0.006,
        laws=("neo_hookean", "blatz_ko"),
        poisson_ratios=RATIOS,
        depth_m=depth,
        force_per_modulus_m2=np.stack([force, 2 * force]),
        surface_rest_m=rng.normal(size=(4, 3)),
        surface_faces=np.array([[0, 1, 2], [1, 2, 3]]),
        surface_displacement_m=np.stack([move, 2 * move]).astype(np.float32),
    )


def test_ladder_ends_at_the_deepest_and_is_finer_at_the_start():
    depth = depth_steps(0.0045, 0.001)
    assert depth[[0, 1, -1]] == pytest.approx([0, 0.00025, 0.0045])
    assert (np.diff(depth) > 0).all()
    assert np.diff(depth).max() <= 0.001 + 1e-12


@pytest.mark.parametrize("nu", [0.05, 0.2, 0.37, 0.46])
def test_force_between_the_table_s_places(model, nu):
    depth = np.linspace(0.0004, 0.009, 31)
    table = force_table(model)
    found = table.force(depth, nu, 0)
    assert found == pytest.approx(hertz(depth, nu), rel=3e-3)
    assert table.force(depth, nu, 1) == pytest.approx(2 * found)


def test_weights_and_slopes_are_those_of_polynomials():
    ratios = np.array([0.0, 0.15, 0.3, 0.42, 0.49])
    weights, slopes = ratio_weights(ratios, 0.29)
    assert weights @ ratios**4 == pytest.approx(0.29**4, rel=1e-9)
    assert slopes @ ratios**4 == pytest.approx(4 * 0.29**3, rel=1e-9)
    assert ratio_weights(ratios, 0.3)[0] == pytest.approx([0, 0, 1, 0, 0], abs=1e-10)


def test_polynomials_go_on_to_incompressibility():
    """Force on a bonded layer (Dimitriadis 2002, to the second power of chi)."""

    def force(nu, chi=0.2):
        a = -(1.2876 - 1.4678 * nu + 1.3442 * nu**2) / (1 - nu)
        return (1 - 2 * a / np.pi * chi + 4 * (a / np.pi * chi) ** 2) / (1 - nu**2)

    ratios = np.array([0.0, 0.2, 0.37, 0.49])
    assert greatest_ratio(ratios) == 0.4999
    assert ratio_weights(ratios, 0.4999)[0] @ force(ratios) == pytest.approx(
        force(0.4999), rel=2e-3
    )
    assert greatest_ratio(ratios[:-1]) == 0.37


def test_before_the_touch_nothing_moves(model):
    table = sample_table(model, model.surface_rest_m, np.eye(4, 3))
    assert table.force(-0.001, 0.3, 1) == 0
    assert np.abs(table.motion(np.array([-0.001]), 0.3, 1, np.zeros(2)).motion_m).max() < 1e-12


def test_mirror_image_twice_is_the_model(model):
    box = trimesh.creation.box((0.2, 0.1, 0.04))
    surface = box.vertices + [0.1, 0.2, 0.02], box.faces
    support = Support(np.array([0.1, 0.2, 0.0]), np.array([0.0, 0.0, 1.0]), 1e-3)
    once = image_table(model, support, surface, [[3, 0, 0]])
    twice = image_table(once, support, surface, [[1, 0, 0]])
    assert once.point_m[0] - 0.1 == pytest.approx(0.1 - model.point_m[0])
    assert once.direction[0] == pytest.approx(-model.direction[0])
    for name, wanted in vars(model).items():
        if name not in ("laws", "radius_m"):
            assert np.allclose(getattr(twice, name), wanted, rtol=1e-6, atol=1e-8)


def test_the_table_of_a_point_in_two_mirrors(model):
    box = trimesh.creation.box((0.2, 0.1, 0.04))
    surface = box.vertices + [0.1, 0.2, 0.02], box.faces
    support = Support(np.array([0.1, 0.2, 0.0]), np.array([0.0, 0.0, 1.0]), 1e-3)
    found = image_table(model, support, surface, [[2, 0, 0], [0, 1, 0]])
    assert found.point_m == pytest.approx([0.19, 0.38, 0.03])
    assert found.direction == pytest.approx([0.0, -0.6, -0.8])
    assert np.array_equal(found.force_per_modulus_m2, model.force_per_modulus_m2)
    move = model.surface_displacement_m * [-1, -1, 1]
    assert found.surface_displacement_m == pytest.approx(move, rel=1e-6)
    lopsided = surface[0] * [1, 1.03, 1]
    for template, normal in ((surface[0], [1, 1, 0]), (lopsided, [0, 1, 0])):
        with pytest.raises(ValueError, match="mirrors: expected planes in which the template"):
            image_table(model, support, (template, box.faces), [normal])


def test_file_keeps_the_model(model, tmp_path):
    save_indentation(tmp_path / "a.npz", model)
    found = load_indentation(tmp_path / "a.npz")
    for name, wanted in vars(model).items():
        assert np.array_equal(getattr(found, name), wanted), name
    save_indentation(tmp_path / "b.npz", found)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_bad_arguments(model):
    with pytest.raises(ValueError, match="laws neo_hookean, blatz_ko, found neo_hookean"):
        force_table(replace(model, laws=("neo_hookean",)))
    with pytest.raises(ValueError, match="deepest_m: expected above 1.5 steps of 0.001 m"):
        depth_steps(0.0015, 0.001)
    for ratios, found in (((0.2, 0.0), "0.2, 0"), ((0.2, 0.2), "0.2, 0.2")):
        with pytest.raises(ValueError, match=f"expected increasing numbers, found {found}"):
            indentation_model(
                *(None, None, np.zeros(3), np.array([0.0, 0, -1])),
                radius_m=0.006,
                deepest_m=0.006,
                poisson_ratios=ratios,
            )


def test_bad_files(model, tmp_path):
    path = tmp_path / "a.npz"
    path.write_bytes(b"nothing")
    with pytest.raises(ValueError, match="a.npz: file: expected an indentation table"):
        load_indentation(path)
    arrays = vars(model) | {"laws": np.array(model.laws)}
    np.savez(path, **{name: arrays[name] for name in arrays if name != "depth_m"})
    with pytest.raises(ValueError, match="a.npz: depth_m: expected an array, found none"):
        load_indentation(path)
    save_indentation(path, replace(model, poisson_ratios=RATIOS[:2]))
    with pytest.raises(ValueError, match="a.npz: force_per_modulus_m2: expected shape"):
        load_indentation(path)


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
