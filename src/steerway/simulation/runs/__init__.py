"""Runs of the simulation as files and pages."""
