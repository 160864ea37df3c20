"""Cost of the drum's junctions, effects and strikes, and the delay until they sound."""
