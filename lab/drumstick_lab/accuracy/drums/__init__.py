"""What the parts about the mesh, the excitation and the drum's effects measure with."""
