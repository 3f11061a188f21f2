"""Estimators of a vessel whose forces are known: dynamic positioning."""
