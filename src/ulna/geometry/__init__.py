"""Lie derivatives, distributions, one-forms and their integration, changes of coordinates, structure of plants."""
