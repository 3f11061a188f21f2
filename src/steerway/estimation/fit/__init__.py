"""Inference: which structures of vessel and receiver a record is evidence for, and with which numbers."""
