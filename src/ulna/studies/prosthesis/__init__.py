"""The prosthesis one could build: drives, loads, intent, and an honest comparison of controllers."""

from ulna.studies.prosthesis.study import ProsthesisStudy, study_prosthesis, summary_table

__all__ = ["ProsthesisStudy", "study_prosthesis", "summary_table"]
