"""`python -m steerway` runs the command `steerway`."""

from steerway.commands.cli import main

if __name__ == "__main__":
    main()
