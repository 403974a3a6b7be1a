"""A plant at one point as dx' = A dx + B du in numbers: its modes, what moves them, and gains on the whole state."""

from ulna.design.linear.feedback import least_cost, least_effort, placed
from ulna.design.linear.linear_plant import LinearPlant, as_numbers, as_rational, as_text, linear_plant
from ulna.design.linear.modes import Mode, Split, holdable, own_bandwidth, require_stabilisable, split
