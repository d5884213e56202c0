"""The display's end of the pipe: it starts the gate, watches it and speaks to it."""
