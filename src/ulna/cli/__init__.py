"""The command line: `ulna ...`."""
