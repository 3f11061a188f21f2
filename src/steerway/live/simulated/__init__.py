"""A scenario's boat as an instrument: she sails in real time and answers on the links that real ones answer on."""
