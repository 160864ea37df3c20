"""Another scene for a rig that plays: asked for, made ready beside the present one, put in its place."""
