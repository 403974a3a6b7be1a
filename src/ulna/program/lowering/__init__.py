"""Lowerings of a `Kernel`, one target a file: import the one you need, so that no other target's library is loaded."""
