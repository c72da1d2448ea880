"""The indentation table: interpolation, mirror images, its file, and the script that makes it."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
import yaml
from palpate.estimate.direct.table import force_table
from palpate.solid import indentation_table
from palpate.solid.load_steps import POISSON_RATIOS, depth_steps, indentation_model
from palpate.solid.mesh import write_solid
from palpate.solid.options import first_images, greatest_ratio
from palpate.solid.support import Support
from settings import full

RATIOS = np.array(POISSON_RATIOS)


def hertz(depth_m, nu):
    return 4 / 3 / (1 - nu**2) * np.sqrt(0.006) * depth_m**1.5


@pytest.fixture(scope="module")
def model():
    rng = np.random.default_rng(5)
    depth = depth_steps(0.009, 0.001)
    force = hertz(depth, RATIOS[:, None])
    move = (1 + RATIOS[:, None, None, None]) * depth[:, None, None] * rng.normal(size=(4, 3))
    return indentation_table.IndentationModel(
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


@pytest.mark.parametrize("nu", [0.05, 0.2, 0.37, 0.46])
def test_force_between_the_table_s_places(model, nu):
    depth = np.linspace(0.0004, 0.009, 31)
    table = force_table(model)
    found = table.force(depth, nu, 0)
    assert found == pytest.approx(hertz(depth, nu), rel=3e-3)
    assert table.force(depth, nu, 1) == pytest.approx(2 * found)
    assert table.force(-0.001, nu, 1) == 0


def test_weights_are_those_of_polynomials_up_to_incompressibility():
    """Force on a bonded layer (Dimitriadis 2002, to the second power of chi)."""
    ratios = np.array([0.0, 0.15, 0.3, 0.42, 0.49])
    weights, slopes = indentation_table.ratio_weights(ratios, 0.29)
    assert weights @ ratios**4 == pytest.approx(0.29**4, rel=1e-9)
    assert slopes @ ratios**4 == pytest.approx(4 * 0.29**3, rel=1e-9)
    at_one, _ = indentation_table.ratio_weights(ratios, 0.3)
    assert at_one == pytest.approx([0, 0, 1, 0, 0], abs=1e-10)

    def force(nu, chi=0.2):
        a = -(1.2876 - 1.4678 * nu + 1.3442 * nu**2) / (1 - nu)
        return (1 - 2 * a / np.pi * chi + 4 * (a / np.pi * chi) ** 2) / (1 - nu**2)

    ratios = np.array([0.0, 0.2, 0.37, 0.49])
    assert greatest_ratio(ratios) == 0.4999
    weights, _ = indentation_table.ratio_weights(ratios, 0.4999)
    assert weights @ force(ratios) == pytest.approx(force(0.4999), rel=2e-3)
    assert greatest_ratio(ratios[:-1]) == 0.37


def test_file_keeps_the_model(model, tmp_path):
    indentation_table.save_indentation(tmp_path / "a.npz", model)
    found = indentation_table.load_indentation(tmp_path / "a.npz")
    for name, wanted in vars(model).items():
        assert np.array_equal(getattr(found, name), wanted), name
    indentation_table.save_indentation(tmp_path / "b.npz", found)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_bad_arguments_and_files(model, tmp_path):
    with pytest.raises(ValueError, match="laws neo_hookean, blatz_ko, found neo_hookean"):
        force_table(replace(model, laws=("neo_hookean",)))
    with pytest.raises(ValueError, match="deepest_m: expected above 1.5 steps of 0.001 m"):
        depth_steps(0.0015, 0.001)
    for ratios, found in (((0.2, 0.0), "0.2, 0"), ((0.2, 0.2), "0.2, 0.2")):
        given = {"radius_m": 0.006, "deepest_m": 0.006, "poisson_ratios": ratios}
        with pytest.raises(ValueError, match=f"expected increasing numbers, found {found}"):
            indentation_model(None, None, np.zeros(3), np.array([0.0, 0, -1]), **given)
    path = tmp_path / "a.npz"
    path.write_bytes(b"nothing")
    with pytest.raises(ValueError, match="a.npz: file: expected an indentation table"):
        indentation_table.load_indentation(path)
    arrays = vars(model) | {"laws": np.array(model.laws)}
    np.savez(path, **{name: arrays[name] for name in arrays if name != "depth_m"})
    with pytest.raises(ValueError, match="a.npz: depth_m: expected an array, found none"):
        indentation_table.load_indentation(path)
    indentation_table.save_indentation(path, replace(model, poisson_ratios=RATIOS[:2]))
    with pytest.raises(ValueError, match="a.npz: force_per_modulus_m2: expected shape"):
        indentation_table.load_indentation(path)


def test_mirror_images_of_a_table(model):
    """Twice in a mirror is the table itself, and once in each of two a point's across both."""
    box = trimesh.creation.box((0.2, 0.1, 0.04))
    vertices = box.vertices + [0.1, 0.2, 0.02]
    support = Support(np.array([0.1, 0.2, 0.0]), np.array([0.0, 0.0, 1.0]), 1e-3)

    def image(of, *normals, template=vertices):
        return indentation_table.image_table(of, support, (template, box.faces), list(normals))

    once = image(model, [3, 0, 0])
    assert once.point_m[0] - 0.1 == pytest.approx(0.1 - model.point_m[0])
    assert once.direction[0] == pytest.approx(-model.direction[0])
    twice = image(once, [1, 0, 0])
    for name, wanted in vars(model).items():
        if name not in ("laws", "radius_m"):
            assert np.allclose(getattr(twice, name), wanted, rtol=1e-6, atol=1e-8)
    found = image(model, [2, 0, 0], [0, 1, 0])
    assert found.point_m == pytest.approx([0.19, 0.38, 0.03])
    assert found.direction == pytest.approx([0.0, -0.6, -0.8])
    assert np.array_equal(found.force_per_modulus_m2, model.force_per_modulus_m2)
    move = model.surface_displacement_m * [-1, -1, 1]
    assert found.surface_displacement_m == pytest.approx(move, rel=1e-6)
    for template, normal in ((vertices, [1, 1, 0]), (vertices * [1, 1.03, 1], [0, 1, 0])):
        with pytest.raises(ValueError, match="mirrors: expected planes in which the template"):
            image(model, normal, template=template)


GRID = {
    "01": {"position_m": [-0.1, -0.05, 0.04]},
    "02": {"position_m": [0.1, -0.05, 0.04]},
    "03": {"position_m": [0.1, 0.05, 0.04]},
    "04": {"position_m": [0.0, 0.05, 0.04]},
}
SLANTED = {"points": GRID | {"02": GRID["02"] | {"direction": [0.1, 0, -1]}}}


@pytest.mark.parametrize(
    ("spec", "images"),
    [
        ({}, {}),
        ({"mirrors": [[2, 0, 0], [0, 1, 0]]}, {"02": ("01", [0]), "03": ("01", [0, 1])}),
        # The mirror lies where the support says.
        ({"support": {"plane_point_m": [0.05, 0, 0]}, "mirrors": [[1, 0, 0]]}, {"04": ("03", [0])}),
        # One of its own direction has no images.
        (SLANTED | {"mirrors": [[1, 0, 0]]}, {}),
    ],
)
def test_points_that_are_images_of_others(spec, images):
    known = {"points": GRID, "support": {"plane_point_m": [0, 0, 0]}}
    own = {name: (name, []) for name in GRID}
    assert first_images(known | spec) == own | images


SIZE, RADIUS, TOP = 0.1, 0.02, [0.05, 0.05, 0.1]


@pytest.fixture
def press(root, stage, tmp_path, cube):
    """Run the script for a cube."""
    box = trimesh.creation.box((SIZE, SIZE, SIZE)).apply_translation([SIZE / 2] * 3)
    box.export(tmp_path / "template.ply")
    write_solid(tmp_path / "solid.vtu", cube)
    config = full(root)["direct"]["model"]
    coarse = {"edge_m": 0.012, "growth": 1.0, "refine_radius_m": 0.03, "step_m": 0.001}
    few = {"poisson_ratios": [0.2, 0.3], "deepest_m": 0.002}

    support = {"plane_point_m": [0, 0, 0], "plane_normal": [0, 0, 1], "tolerance_m": 0.001}
    content = {"template": {"unit": "m"}, "support": support}
    content |= {"points": {"01": {"position_m": TOP}, "02": {"position_m": [0.05, 0.05, 0.12]}}}
    (tmp_path / "object.yaml").write_text(yaml.safe_dump(content))

    def run(point="01", **options):
        names = {"object": "object.yaml", "template": "template.ply", "solid": "solid.vtu"}
        inputs = {name: tmp_path / file for name, file in names.items()} | {"image": None}
        params = {"mirrors": [], "probe": {"indenter": {"radius_m": RADIUS}}}
        params["options"] = config | coarse | few | options
        given = {"params": params, "wildcards": {"object": "cube", "point": point}}
        return stage("indentation", inputs=inputs, outputs={"model": "model.npz"}, **given)

    return run


def test_table_of_a_cube(press, tmp_path):
    assert press() is None
    model = indentation_table.load_indentation(tmp_path / "model.npz")
    assert model.laws == ("neo_hookean", "blatz_ko")
    assert model.depth_m[-1] == pytest.approx(0.002)
    assert model.point_m == pytest.approx(TOP, abs=1e-6)
    hertz = 4 / 3 / (1 - 0.25**2) * np.sqrt(RADIUS) * 0.002**1.5
    assert 0.8 < force_table(model).force(0.002, 0.25, law=1) / hertz < 1.4
    log = (tmp_path / "log.txt").read_text()
    assert "blatz_ko, Poisson's ratio 0.3:" in log


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"point": "07"}, "object.yaml: points: expected one of 01, 02, found 07"),
        ({"point": "02"}, "object.yaml: point_m: expected within 0.005 m of the surface"),
        ({"deepest_m": 0.15}, "object.yaml: deepest_m: expected above 0 and below the thickness"),
    ],
)
def test_bad_input(press, change, message):
    assert message in press(**change)
