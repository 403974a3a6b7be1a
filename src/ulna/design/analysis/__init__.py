"""The standard questions about a plant and their answers."""

from ulna.design.analysis.analysis import Analysis, analyse
from ulna.design.analysis.answer import Answer
