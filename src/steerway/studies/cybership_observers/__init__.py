"""P2: observers for dynamic positioning on CyberShip II, and the best one beside them."""

from steerway.studies.cybership_observers.study import STUDY

__all__ = ["STUDY"]
