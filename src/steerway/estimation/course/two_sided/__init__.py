"""Smoothing of a vessel of several manners of moving, by the histories that a record supports."""
