# How true to life the lab is: its sensors' errors beside those of real devices.
rule plane_noise:
    input:
        planes=raw("sensors/{sensor}/planes"),
    output:
        noise=results("sensors/{sensor}/plane_noise.csv"),
    log:
        results("logs/plane_noise/{sensor}.log"),
    benchmark:
        results("benchmarks/plane_noise/{sensor}.tsv")
    params:
        code=code("plane_noise"),
        content=experiment_content("planes"),
        sensor=sensor_spec,
    message:
        "Depth noise of the {wildcards.sensor} on planes"
    script:
        "../scripts/plane_noise.py"


rule lab_fidelity:
    input:
        planes=sensor_files("planes", "plane_noise.csv"),
        workspaces=sensor_files("workspace", "workspace.csv"),
        holds=sensor_files("loading", "loading.csv"),
        templates=expand(results("{object}/template.ply"), object=scanned_by_lab()),
        truths=first_truths(scanned_by_lab()),
        published=published("table_4_2"),
    output:
        csv=results("tables/lab_fidelity.csv"),
        md=results("tables/lab_fidelity.md"),
        png=captioned(results("figures/lab_fidelity.png")),
        svg=results("figures/lab_fidelity.svg"),
    log:
        results("logs/lab_fidelity.log"),
    benchmark:
        results("benchmarks/lab_fidelity.tsv")
    params:
        code=code("lab_fidelity"),
        sensors=HOUSE.sensors,
        planes=sensors_of("planes"),
        workspace=sensors_of("workspace"),
        loading=sensors_of("loading"),
        scanned=scanned_by_lab(),
    message:
        "The lab's errors beside those of real devices"
    script:
        "../scripts/lab_fidelity.py"
