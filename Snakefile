# Palpate: how stiff a soft object is, from one depth camera and a hand-held force probe.
from snakemake.utils import min_version

min_version("9.0")


configfile: "config/config.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/common_lab.smk"
include: "workflow/rules/common_sensors.smk"
include: "workflow/rules/common_simulation.smk"
include: "workflow/rules/common_hertz.smk"
include: "workflow/rules/common_hertz_figures.smk"
include: "workflow/rules/common_tracking.smk"
include: "workflow/rules/common_steps.smk"
include: "workflow/rules/common_diagrams.smk"
include: "workflow/rules/common_comparison.smk"
include: "workflow/rules/common_direct.smk"
include: "workflow/rules/common_own_objects.smk"
include: "workflow/rules/common_report.smk"
include: "workflow/rules/common_validation.smk"
include: "workflow/rules/lab.smk"
include: "workflow/rules/calibration.smk"
include: "workflow/rules/preprocess.smk"
include: "workflow/rules/seeing.smk"
include: "workflow/rules/sensor_reports.smk"
include: "workflow/rules/fidelity.smk"
include: "workflow/rules/surface.smk"
include: "workflow/rules/hertz.smk"
include: "workflow/rules/hertz_figures.smk"
include: "workflow/rules/elasticity.smk"
include: "workflow/rules/direct.smk"
include: "workflow/rules/steps.smk"
include: "workflow/rules/simulation.smk"
include: "workflow/rules/study.smk"
include: "workflow/rules/tracking_figures.smk"
include: "workflow/rules/diagrams.smk"
include: "workflow/rules/comparison.smk"
include: "workflow/rules/own_objects.smk"
include: "workflow/rules/progress.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/validation.smk"
include: "workflow/rules/local.smk"


rule all:
    default_target: True
    input:
        study_outputs(),


rule lab:
    input:
        lab_outputs(),
