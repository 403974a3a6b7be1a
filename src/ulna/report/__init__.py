"""Reports: a value in, a document out. One HTML page without network, JSON results, folders written whole."""

from ulna.report.decimals import with_decimals
from ulna.report.document import (
    Badge,
    Block,
    Card,
    Cell,
    Document,
    Fold,
    Formula,
    Frame,
    Link,
    Picture,
    Row,
    Section,
    Table,
    Text,
    Tone,
)
from ulna.report.folder import output_folder
from ulna.report.page import render_page
from ulna.report.results import plain, results_text
from ulna.report.words import value_text, verbatim

__all__ = [
    "Badge",
    "Block",
    "Card",
    "Cell",
    "Document",
    "Fold",
    "Formula",
    "Frame",
    "Link",
    "Picture",
    "Row",
    "Section",
    "Table",
    "Text",
    "Tone",
    "output_folder",
    "plain",
    "render_page",
    "results_text",
    "value_text",
    "verbatim",
    "with_decimals",
]
