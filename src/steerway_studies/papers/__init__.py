"""The papers' forms exactly as printed, labelled: for studies and tests, never for the product."""

from steerway_studies.papers.ekf_5states import ekf_5states

__all__ = ["ekf_5states"]
