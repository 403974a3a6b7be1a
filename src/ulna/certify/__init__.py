"""Proof: what is claimed of a loop, proved by machine, and a file that a second program can check."""

from ulna.certify.certificate import Certificate, read_certificate
from ulna.certify.checker import check
from ulna.certify.claims import Claim, GloballyStable, Over, Region, StableWithin
from ulna.certify.errors import CertifyError
from ulna.certify.level_set import LevelSet, level_set
from ulna.certify.prove import prove

__all__ = [
    "Certificate",
    "CertifyError",
    "Claim",
    "GloballyStable",
    "LevelSet",
    "Over",
    "Region",
    "StableWithin",
    "check",
    "level_set",
    "prove",
    "read_certificate",
]
