"""P2: observers for dynamic positioning on CyberShip II, and the best one beside them."""

from steerway_studies.cybership_observers.study import STUDY

__all__ = ["STUDY"]
