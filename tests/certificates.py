"""Certificates of localhost's, for editors over TLS."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest


def certificate_of_localhost(folder: Path) -> tuple[Path, Path]:
    """A certificate and its key, made in the folder; the test is skipped where openssl is not there."""
    if shutil.which("openssl") is None:
        pytest.skip("certificates for this test are made by openssl, which is not here")
    file, key = folder / "cert.pem", folder / "key.pem"
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", *subject]
    subprocess.run([*command, "-keyout", key, "-out", file], check=True, capture_output=True)
    return file, key
