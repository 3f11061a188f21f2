"""MAVLink: decoding a vehicle's messages to rows, and the protocol that steers a vehicle in GUIDED."""
