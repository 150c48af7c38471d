from .cage import Cage as Cage
