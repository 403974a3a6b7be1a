"""Proof: what is claimed of a loop, proved by machine, and a file that a second program can check."""

from ulna.certify.certificate import Certificate, SampledCertificate, read_certificate
from ulna.certify.checker import check
from ulna.certify.claims import Claim, GloballyStable, Over, Region, StableWithin, UltimateBound
from ulna.certify.errors import CertifyError, ChangedError
from ulna.certify.level_set import LevelSet, level_set
from ulna.certify.prove import prove

__all__ = [
    "Certificate",
    "CertifyError",
    "ChangedError",
    "Claim",
    "GloballyStable",
    "LevelSet",
    "Over",
    "Region",
    "SampledCertificate",
    "StableWithin",
    "UltimateBound",
    "check",
    "level_set",
    "prove",
    "read_certificate",
]
