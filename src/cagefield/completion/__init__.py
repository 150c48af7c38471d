"""Patches: what discrete edits uncovered is filled, and shadows go along."""

from __future__ import annotations
