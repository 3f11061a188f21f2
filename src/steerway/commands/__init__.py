"""The commands of the program: each reads its options, calls the library and prints the result."""
