"""Who a machine is: keys, certificates, rig files, router files."""
