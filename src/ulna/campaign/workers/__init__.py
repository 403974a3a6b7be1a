"""Who computes the batches of a campaign."""

from ulna.campaign.workers.workers import DaskWorkers, LocalWorkers, Workers

__all__ = ["DaskWorkers", "LocalWorkers", "Workers"]
