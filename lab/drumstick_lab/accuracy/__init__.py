"""`drumstick accuracy`: what accuracy costs in time on this machine, of stick, servo, mesh, excitation and effects."""
