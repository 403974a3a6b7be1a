"""The prosthesis one could build: drives, loads, intent, and an honest comparison of controllers."""

from ulna.studies.prosthesis.emg_recording import read_recording
from ulna.studies.prosthesis.emg_signal import Recording
from ulna.studies.prosthesis.study import ProsthesisStudy, study_prosthesis, summary_table

__all__ = ["ProsthesisStudy", "Recording", "read_recording", "study_prosthesis", "summary_table"]
