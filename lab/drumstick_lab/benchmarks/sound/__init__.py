"""What the drum's junctions, effects and strikes cost, and how soon they sound."""
