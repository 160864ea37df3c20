"""What the wire carries, how soon and to how many; recordings; starts."""
