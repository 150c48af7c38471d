from .cage import Cage as Cage
from .cage import LatticeCage as LatticeCage
