"""Permissions on the network: roles, the routers' rules made from them, certificates, and refusals in words."""
