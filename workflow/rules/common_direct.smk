# Options of the direct estimation.
MODEL = {k: v for k, v in config["direct"]["model"].items() if k != "objects"}


def model_options(wildcards):
    """Options of an object's look-ups."""
    return MODEL | config["direct"]["model"]["objects"].get(wildcards.object, {})
