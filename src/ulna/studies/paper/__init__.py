"""The paper's forearm and compensator: what is printed, what comes out, and what the difference means."""
