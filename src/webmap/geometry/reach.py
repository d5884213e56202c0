"""How far away anything can be."""

FARTHEST = 1e7
"""Metres: a number beyond the size of a planet is a mistake, and no browser draws it.

Numbers that are finite and absurd, such as 1e300, overflow the single precision that
browsers draw with, and the whole view then fits nothing.
"""
