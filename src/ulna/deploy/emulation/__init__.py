"""Programs on an emulated processor, their instructions counted."""

from ulna.deploy.emulation.board import Ran, run_on_board
from ulna.deploy.emulation.cost import Cost, cost_of

__all__ = ["Cost", "Ran", "cost_of", "run_on_board"]
