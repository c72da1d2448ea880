"""What a look into a folder of captures finds."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Findings:
    """Lines on a folder, or on several.

    Attributes
    ----------
    wrong : tuple of str
        What must be mended.
    doubts : tuple of str
        What may be as it should, but seldom is.
    found : tuple of str
        What is there.
    """

    wrong: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    found: tuple[str, ...] = ()

    def __add__(self, other: "Findings") -> "Findings":
        """Both together, in their order."""
        return Findings(
            self.wrong + other.wrong, self.doubts + other.doubts, self.found + other.found
        )
