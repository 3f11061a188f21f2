"""MAVLink: the messages of a vehicle as rows, and the protocol with one that is steered in GUIDED."""
