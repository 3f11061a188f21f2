"""The autopilot aboard: guidance on a geodetic route, the pilot that simulation also uses, and its supervision."""
