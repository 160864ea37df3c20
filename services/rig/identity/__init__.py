"""Identity of a machine on the network: keys, certificates, rig files, router files."""
