"""NMEA 2000 on the wire: frames, messages, the claim of an address, and the links that carry them."""
