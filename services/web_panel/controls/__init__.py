"""Controls on the page: sliders, exact entry, undo row, keys, presets, lease and scenes."""
