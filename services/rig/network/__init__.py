"""Running rigs on the network: discovery, and commands sent to one."""
