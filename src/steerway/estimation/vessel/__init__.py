"""Models of vessel and receiver: parts, structures, aids and profiles."""
