"""Options of the Hertz fit."""

from typing import Literal

from palpate.config.model import Length, Model, Positive, constant, option


class Beliefs(Model):
    """What is held likely of relaxation before a record is seen (docs/how_it_works.md).

    Any split of the relaxed share among the relaxation times is as likely as any other.
    """

    share: float = constant(
        0.3, "scale of the half-normal share of the modulus that relaxes", gt=0, le=1
    )
    none: float = constant(0.1, "probability that nothing relaxes", ge=0, lt=1)
    law_std: float = constant(0.02, "relative error of the contact law", gt=0, le=1)
    law_growth_std: float = constant(
        0.13, "of what it grows by with sqrt(d/R): half of the way to Blatz and Ko", gt=0, le=1
    )
    at_s: Positive = constant(1.0, "the modulus is also stated so long after a step")


class Hertz(Model):
    """Reduced modulus from force and depth (Section 5.1)."""

    onset_force_n: Positive = option(0.1, "smallest force that counts as contact")
    offset_std_m: Length = option(
        0.001, "of the depth's zero, from tip and alignment; direct.fit.offset_std_m is wider"
    )
    baseline: bool = option(False, "true: fit a constant force too")
    residual: Literal["force", "force_two_thirds"] = option(
        "force", "compared; force_two_thirds: its power 2/3, in which Eq. 5.1 is straight"
    )
    assumed_poisson_ratio: float = option(
        0.33, "of layers; Gibson and Ashby's for foams, and 0 to 0.499 beside it", ge=0, le=0.5
    )
    relaxation: Beliefs = option(Beliefs(), "what is held likely of it")
