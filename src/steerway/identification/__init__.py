"""Identification: what a manoeuvre tells about the vessel, with intervals."""
