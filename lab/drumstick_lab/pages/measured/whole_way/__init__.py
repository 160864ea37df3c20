"""Parts of docs/accuracy-and-time.md that are made of the whole way: whole set-ups, stages, and the figure's points."""
