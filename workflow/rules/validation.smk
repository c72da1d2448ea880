# Palpate on other materials, shapes, depths and seeds than the study's: make validation.
rule validation:
    input:
        validation_outputs(),
    message:
        "The validation set is recorded, and its clouds and forces are there"
