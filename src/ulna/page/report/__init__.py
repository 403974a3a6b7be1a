"""The report on a plant and its loop: one page with everything that is known of them, the live page inside."""

from ulna.page.report.fitted import fit_page
from ulna.page.report.writing import report_page, report_text, require_folder

__all__ = ["fit_page", "report_page", "report_text", "require_folder"]
