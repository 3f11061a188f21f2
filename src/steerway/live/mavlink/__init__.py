"""MAVLink: what a vehicle says as rows, and the conversation with one that is steered in GUIDED."""
