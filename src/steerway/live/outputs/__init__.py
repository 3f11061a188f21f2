"""What is said, in which form and when."""
