"""Fixed-interval smoothing: of one mode, and of two with several hypotheses of when they changed."""
