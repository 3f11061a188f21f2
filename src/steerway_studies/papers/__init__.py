"""The papers' methods exactly as printed, for studies and tests only."""

from steerway_studies.papers.ekf_5states import ekf_5states

__all__ = ["ekf_5states"]
