"""Figure 5.6: rigid alignment that slides along the block without added points."""

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.study import rigid_slide, style
from palpate.surface.alignment import standing_of
from palpate.surface.augment import undeformed_points
from palpate.surface.pose import align_rigidly, to_camera, to_object
from palpate.surface.template import refine_template, vertex_normals
from palpate.vision.support_plane import read_plane
from tracking_inputs import last_frames, recordings_of

SHIFTS_M = np.array([-60, -40, -20, -10, 0, 10, 20, 40, 60]) / 1000
SHOWN_M = 0.040
# Of the cloud is kept what lies this far from the block's end.
KEPT_M = (0.030, 0.230)
REACH_M, WHOLE_M, SPACING_M = 0.040, 1.0, 0.006


def main(snakemake):
    """Align the cut cloud from shifted poses and draw the figure."""
    recorded = recordings_of(snakemake.input, snakemake.params.probes)[0]
    options = dict(snakemake.params.options)
    options.pop("limits")
    ways, placed = ways_of(recorded, last_frames(snakemake.input)[0], standing(snakemake, recorded))
    right = recorded.alignment.camera_from_object
    left = {
        name: np.array([off(way(rigid_slide.shifted(right, s), options)) for s in SHIFTS_M])
        for name, way in ways.items()
        for off in [lambda pose: rigid_slide.slide(pose, right, np.zeros(3))]
    }
    shown = []
    for name, title in TITLES.items():
        pose = ways[name](rigid_slide.shifted(right, SHOWN_M), options)
        slid = 1e3 * rigid_slide.slide(pose, right, np.zeros(3))
        clouds = [to_object(pose, points) for points in placed[name]]
        shown.append((f"{title}: slid {slid:+.1f} mm", *clouds))
    slides = rigid_slide.Slides(SHIFTS_M, left)
    with style.journal():
        figure = rigid_slide.figure_5_6(
            snakemake.params.captures[0], recorded.template, shown, slides, note=note_of(options)
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


TITLES = {
    "Eq. 4.24, cut cloud": "Eq. 4.24 alone",
    "Eq. 4.24, cut cloud + added": "with added points (orange)",
    "with table and touch": "with table and touched point",
}
NOTE = (
    f"Cloud cut to {1e3 * KEPT_M[0]:g} to {1e3 * KEPT_M[1]:g} mm from the block's end;"
    f" a, b, c: first pose shifted {1e3 * SHOWN_M:g} mm; black: template.\n"
    "Each vertex pairs with the nearest point within"
)


def note_of(options):
    """What was cut, shifted and sought, in words under the figure."""
    reach = f" dr = {1e3 * options['largest_distance_m']:g} mm"
    return f"{NOTE}{reach}: on flat faces any shift stays, with added points too."


def standing(snakemake, recorded):
    """What table and touched point tell of the block's place."""
    declared = load_yaml(snakemake.input.object[0])
    point = declared["points"][snakemake.params.captures[0]["point"]]["position_m"]
    plane = read_plane(snakemake.input.planes[0])
    tip = recorded.tips_m[recorded.alignment.contact_frame]
    radius = recorded.indenter_radius_m
    return standing_of(recorded.support, point, plane, tip, indenter_radius_m=radius)


def ways_of(recorded, frame, known):
    """Ways to align, by name, and the points that each one places."""
    template, pose = recorded.template, recorded.alignment.camera_from_object
    (whole, whole_normals), added = recorded.clouds[frame], added_places(recorded)
    x = to_object(pose, whole)
    end = template.vertices_m[:, 0].max()
    kept = rigid_slide.without_ends(x, low_m=end - KEPT_M[1], high_m=end - KEPT_M[0])
    points, normals = whole[kept], whole_normals[kept]
    more = np.vstack([points, added[0]]), np.vstack([normals, added[1]])
    nearest, none = rigid_slide.align_to_nearest, np.zeros((0, 3))
    ways = {
        "Eq. 4.24, cut cloud": lambda p, o: nearest(template, points, normals, p, **o),
        "Eq. 4.24, whole cloud": lambda p, o: nearest(template, whole, whole_normals, p, **o),
        "Eq. 4.24, cut cloud + added": lambda p, o: nearest(template, *more, p, **o),
        "with table and touch": lambda p, o: align_rigidly(
            template, points, normals, p, standing=known, **o
        ),
    }
    placed = dict.fromkeys(ways, (points, none))
    placed["Eq. 4.24, cut cloud + added"] = points, added[0]
    return ways, placed


def added_places(recorded):
    """Points of the template that no camera sees and no press reaches, and their normals.

    As close as a cloud's: the template's own vertices would lock it at multiples of its edges.
    """
    alignment = recorded.alignment
    template = refine_template(
        recorded.template, alignment.contact_point_m, radius_m=WHOLE_M, edge_m=SPACING_M
    )
    rest = to_camera(alignment.camera_from_object, template.vertices_m)
    contact = to_camera(alignment.camera_from_object, alignment.contact_point_m)
    still = undeformed_points(rest, recorded.clouds[0][0], contact, reach_m=REACH_M)
    return rest[still], vertex_normals(rest, template.faces)[still]


run(main, snakemake)
