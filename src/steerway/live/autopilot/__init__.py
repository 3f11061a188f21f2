"""The autopilot aboard: guidance on a geodetic route, the pilot of simulation, and supervision around it."""
