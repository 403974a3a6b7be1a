"""What was measured: files and tables in SI, beside a plant."""

from ulna.identification.records.record import Record, as_record, as_records, factor_of, read_record
from ulna.identification.records.recorded_experiment import Experiment, experiments, measured_system
from ulna.identification.records.sheet import Sheet, read_sheet

__all__ = [
    "Experiment",
    "Record",
    "Sheet",
    "as_record",
    "as_records",
    "experiments",
    "factor_of",
    "measured_system",
    "read_record",
    "read_sheet",
]
