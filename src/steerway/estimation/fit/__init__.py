"""Inference: the structures of vessel and receiver that explain a record best, and their numbers."""
