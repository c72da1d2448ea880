# Captures of the validation set: materials that nothing was tuned on (config/validation.yaml).
def validation_outputs():
    """Estimates of every capture and object of the set, held against the truth."""
    names = ["validation", "validation_summary"]
    return [results(f"tables/{name}.{end}") for name in names for end in ("csv", "md")]
