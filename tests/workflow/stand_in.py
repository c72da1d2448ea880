"""Stands in for what Snakemake hands to a script."""


class Named(list):
    """Values by place and by name, as Snakemake's own lists are."""

    def __init__(self, **values):
        super().__init__(values.values())
        self.__dict__ |= values

    def get(self, name, default=None):
        return self.__dict__.get(name, default)
