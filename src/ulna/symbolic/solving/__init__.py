"""Equations solved: inverse maps, level sets, roots and where they lie, series."""
