"""Geometry: cages, trilinear hexahedra, quaternions."""
