"""Records of fixes: defects of receivers and loggers, latency, accuracy, estimation, and comparison of two records."""
