"""What makes the ready files for DAWs and patching programs."""
