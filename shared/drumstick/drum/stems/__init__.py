"""Stems: single pickups and microphones, taken out of a drum's mix into output pairs of their own."""
