"""Outputs: the format and the timing of sent messages; `live.addresses.FORMATS` lists the formats."""
