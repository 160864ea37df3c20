"""Change of the scene: asking for another, making it ready, and what a gateway has of the one that plays."""
