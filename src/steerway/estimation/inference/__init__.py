"""Inference of a whole record: structures of vessel and receiver, their evidence, and the motion they mean."""
