"""Identification: what a boat is, from a log of what she did."""

from steerway.identification.surge import SurgeIdentification, SurgeModel, identify_surge

__all__ = ["SurgeIdentification", "SurgeModel", "identify_surge"]
