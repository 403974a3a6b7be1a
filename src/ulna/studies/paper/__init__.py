"""The paper, equation by equation: printed against exact, and what the printed controller does."""

from ulna.studies.paper.study import Study, reproduce, summary_table

__all__ = ["Study", "reproduce", "summary_table"]
