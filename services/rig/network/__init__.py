"""Running rigs on the network: how one is reached, discovery, commands sent to one; free ports of this machine."""
