"""Completion of edited fields: inpainting of uncovered surfaces, and relighting."""

from __future__ import annotations
