"""Controller form, input-output form and what decides whether they exist: linearisability, extension, flatness."""
