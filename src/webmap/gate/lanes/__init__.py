"""The gate's sockets to the robots' bridges, and what is written to them and read."""
