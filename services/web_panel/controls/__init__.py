"""Controls on the page: sliders, exact entry, undo row, presets, lease and scenes."""
