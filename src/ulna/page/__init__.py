"""The page: a loop lowered to JavaScript, to be driven by hand in a browser."""

from ulna.page.embedding import json_text
from ulna.page.inside import live_blocks
from ulna.page.replay import replay_data
from ulna.page.report import fit_page, report_page, report_text
from ulna.page.script import LoopScript, loop_script, runtime_script
from ulna.page.source import SetPointSource
from ulna.page.writing import studio, studio_text

__all__ = [
    "LoopScript",
    "SetPointSource",
    "fit_page",
    "json_text",
    "live_blocks",
    "loop_script",
    "replay_data",
    "report_page",
    "report_text",
    "runtime_script",
    "studio",
    "studio_text",
]
