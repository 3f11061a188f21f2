"""The autopilot aboard: states in front of a control law, and what it may not leave."""
