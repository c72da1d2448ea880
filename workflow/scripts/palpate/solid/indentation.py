"""stub"""
from dataclasses import dataclass
import numpy as np
from scipy.interpolate import BarycentricInterpolator
@dataclass(frozen=True)
class IndentationModel:
    point_m: object
    direction: object
    radius_m: float
    laws: tuple
    poisson_ratios: object
    depth_m: object
    force_per_modulus_m2: object
    surface_rest_m: object
    surface_faces: object
    surface_displacement_m: object
def poisson_weights(nus, nu):
    nus=np.asarray(nus,float)
    return np.array([np.prod([(nu-b)/(a-b) for b in nus if b!=a]) for a in nus])
