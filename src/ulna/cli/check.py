"""`ulna check PROOF`: a certificate, proved again by the second program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ulna.cli.options import AsJson
from ulna.cli.terminal import print_json, progress


def check(
    file: Annotated[Path, typer.Argument(metavar="PROOF", help="A certificate of `ulna prove --out`.")],
    as_json: AsJson = False,
) -> None:
    """Prove a certificate again, by code that shares nothing with the prover but the formula reader.

    The exit status is 1 where the certificate is not right.
    """
    from ulna.base import Verdict
    from ulna.certify import ChangedError, read_certificate
    from ulna.certify import check as checked

    try:
        certificate = read_certificate(file)
        with progress(f"checking '{certificate.name}'"):
            verdict = checked(certificate)
    except ChangedError as error:
        verdict = Verdict.refuted(f"'{file}' is a certificate that is right", reason=str(error))
    if as_json:
        print_json({"right": verdict.holds, "claim": verdict.claim, **verdict.evidence})
    else:
        typer.echo(str(verdict))
        for name, value in verdict.evidence.items():
            typer.echo(f"  {name}: {value}")
    if not verdict.holds:
        raise typer.Exit(1)
