"""Speed along the hull from several instruments, and which of them to believe."""
