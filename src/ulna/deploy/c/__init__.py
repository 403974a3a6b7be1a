"""C99 for a processor: the language's own room, its texts in `templates`."""

from ulna.deploy.c.writing import DESIGN, c_files

__all__ = ["DESIGN", "c_files"]
