"""The standard questions about a plant and their answers."""
